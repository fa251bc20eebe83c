//! A writer of small TIFFs, valid and invalid.

/// The value of a tag.
#[derive(Clone)]
pub(super) enum Value {
    Short(Vec<u16>),
    Long(Vec<u32>),
    Double(Vec<f64>),
    Ascii(&'static str),
    /// A type, a count and an offset, written as given.
    Raw(u16, u32, u32),
}
use Value::{Ascii, Double, Long, Raw, Short};

/// One image: its tags, its data, and the offset of the next image.
#[derive(Clone)]
pub(super) struct Tiff {
    pub(super) tags: Vec<(u16, Value)>,
    pub(super) data: Vec<u8>,
    pub(super) next: u32,
}

/// Offset of the data in [`Tiff::bytes`].
pub(super) const DATA: u32 = 2048;

pub(super) const WIDTH: u16 = 256;
pub(super) const HEIGHT: u16 = 257;
pub(super) const BITS: u16 = 258;
pub(super) const COMPRESSION: u16 = 259;
pub(super) const OFFSETS: u16 = 273;
pub(super) const BANDS: u16 = 277;
pub(super) const ROWS_PER_STRIP: u16 = 278;
pub(super) const COUNTS: u16 = 279;
pub(super) const SUBFILE: u16 = 254;
pub(super) const PHOTOMETRIC: u16 = 262;
pub(super) const TILE_WIDTH: u16 = 322;
pub(super) const TILE_HEIGHT: u16 = 323;
pub(super) const TILE_OFFSETS: u16 = 324;
pub(super) const TILE_COUNTS: u16 = 325;
pub(super) const SAMPLE_FORMAT: u16 = 339;
pub(super) const SCALE: u16 = 33550;
pub(super) const TIE_POINT: u16 = 33922;
pub(super) const TRANSFORMATION: u16 = 34264;
pub(super) const KEYS: u16 = 34735;
pub(super) const GDAL_METADATA: u16 = 42112;
pub(super) const NO_DATA: u16 = 42113;

/// Geo keys: the model type, and a reference system by key and code.
pub(super) fn keys(model: u16, key: u16, code: u16) -> Value {
    Short(vec![
        1, 1, 0, 3, 1024, 0, 1, model, 1025, 0, 1, 1, key, 0, 1, code,
    ])
}

impl Tiff {
    /// 4 x 3 single-precision samples in degrees, 0 to 11 m.
    pub(super) fn right() -> Self {
        let samples = (0..12_u8).map(f32::from);
        Self {
            tags: vec![
                (WIDTH, Short(vec![4])),
                (HEIGHT, Short(vec![3])),
                (BITS, Short(vec![32])),
                (COMPRESSION, Short(vec![1])),
                (262, Short(vec![1])),
                (OFFSETS, Long(vec![DATA])),
                (BANDS, Short(vec![1])),
                (ROWS_PER_STRIP, Short(vec![3])),
                (COUNTS, Long(vec![48])),
                (SAMPLE_FORMAT, Short(vec![3])),
                (SCALE, Double(vec![0.01, 0.01, 0.0])),
                (TIE_POINT, Double(vec![0.0, 0.0, 0.0, 8.0, 45.0, 0.0])),
                (KEYS, keys(2, 2048, 4326)),
            ],
            data: samples.flat_map(f32::to_le_bytes).collect(),
            next: 0,
        }
    }

    /// Replaces the value of a tag.
    pub(super) fn with(mut self, tag: u16, value: Value) -> Self {
        self.tags.retain(|(known, _)| *known != tag);
        self.tags.push((tag, value));
        self.tags.sort_by_key(|(tag, _)| *tag);
        self
    }

    pub(super) fn without(mut self, tag: u16) -> Self {
        self.tags.retain(|(known, _)| *known != tag);
        self
    }

    /// With these bytes as its only strip.
    pub(super) fn holding(self, data: Vec<u8>) -> Self {
        let count = u32::try_from(data.len()).expect("a small file");
        Self {
            data,
            ..self.with(COUNTS, Long(vec![count]))
        }
    }

    pub(super) fn bytes(&self) -> Vec<u8> {
        let mut file = b"II*\0\x08\0\0\0".to_vec();
        file.extend(self.directory(8));
        assert!(
            file.len() <= DATA as usize,
            "{} bytes of headers",
            file.len()
        );
        file.resize(DATA as usize, 0);
        file.extend(&self.data);
        file
    }

    /// A file of this image and then `second`, whose offsets count from its own beginning.
    pub(super) fn followed_by(mut self, mut second: Self) -> Vec<u8> {
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        let at = DATA + u32::try_from(self.data.len()).expect("a small file");
        self.next = at;
        for (tag, value) in &mut second.tags {
            if let (OFFSETS | TILE_OFFSETS, Long(offsets)) = (*tag, value) {
                for offset in offsets {
                    *offset += at;
                }
            }
        }
        let mut file = self.bytes();
        file.extend(second.directory(at as usize));
        file.resize((at + DATA) as usize, 0);
        file.extend(second.data);
        file
    }

    /// The tags and their values, `at` bytes from the beginning of the file.
    fn directory(&self, at: usize) -> Vec<u8> {
        let mut file = Vec::new();
        let entries = u16::try_from(self.tags.len()).expect("few tags");
        file.extend(entries.to_le_bytes());
        // Values that do not fit into their entries.
        let mut values = Vec::new();
        let values_at = at + 2 + 12 * self.tags.len() + 4;
        for (tag, value) in &self.tags {
            let (kind, count, bytes) = match value {
                Short(values) => (
                    3_u16,
                    values.len(),
                    values
                        .iter()
                        .flat_map(|value| value.to_le_bytes())
                        .collect(),
                ),
                Long(values) => (
                    4,
                    values.len(),
                    values
                        .iter()
                        .flat_map(|value| value.to_le_bytes())
                        .collect(),
                ),
                Double(values) => (
                    12,
                    values.len(),
                    values
                        .iter()
                        .flat_map(|value| value.to_le_bytes())
                        .collect(),
                ),
                Ascii(text) => (2, text.len() + 1, [text.as_bytes(), b"\0"].concat()),
                Raw(kind, count, offset) => {
                    file.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
                    file.extend([count.to_le_bytes(), offset.to_le_bytes()].concat());
                    continue;
                }
            };
            let mut bytes: Vec<u8> = bytes;
            file.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
            file.extend(u32::try_from(count).expect("few values").to_le_bytes());
            if bytes.len() <= 4 {
                bytes.resize(4, 0);
                file.extend(bytes);
            } else {
                let at = u32::try_from(values_at + values.len()).expect("a small file");
                file.extend(at.to_le_bytes());
                values.extend(bytes);
            }
        }
        file.extend(self.next.to_le_bytes());
        file.extend(values);
        file
    }
}
