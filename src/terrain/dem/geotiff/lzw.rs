//! Strips and tiles packed by LZW. They are unpacked here, because the library that reads everything else of a TIFF calls
//! some of them damaged: those whose bytes end just where its buffer is full.

use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};

use tiff_reader::ByteOrder;
use tiff_reader::filters::fix_endianness_and_predict;
use weezl::decode::Decoder;
use weezl::{BitOrder, LzwStatus};

use super::{malformed, refusal};
use crate::terrain::dem::DemError;

/// TIFF's number of this scheme.
pub(super) const SCHEME: u16 = 5;

/// Bytes that a code takes for each byte that it stands for, at most; and those of the codes that stand for none.
const LONGEST: usize = 2;
const MARKERS: usize = 1024;

/// How the samples of a packed block are stored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lzw {
    pub(super) predictor: u16,
    pub(super) bits: u16,
    pub(super) order: ByteOrder,
}

impl Lzw {
    /// The first `rows` of a block, each of so many bytes, in the byte order of this machine. The block lies in `file` at
    /// an offset, and is so many bytes long.
    pub(super) fn read(
        self,
        file: &mut File,
        [offset, count]: [u64; 2],
        (rows, row_bytes): (usize, usize),
    ) -> Result<Vec<u8>, DemError> {
        let most = LONGEST * rows * row_bytes + MARKERS;
        let mut packed = Vec::new();
        file.seek(SeekFrom::Start(offset))?;
        file.take(count.min(most as u64)).read_to_end(&mut packed)?;
        let mut bytes = unpack(&packed, rows * row_bytes)?;
        for row in bytes.chunks_exact_mut(row_bytes) {
            fix_endianness_and_predict(row, self.bits, 1, self.order, self.predictor)
                .map_err(|error| refusal(&error))?;
        }
        Ok(bytes)
    }
}

/// The first `len` bytes.
fn unpack(packed: &[u8], len: usize) -> Result<Vec<u8>, DemError> {
    let mut decoder = Decoder::with_tiff_size_switch(BitOrder::Msb, 8);
    let mut bytes = vec![0; len];
    let (mut read, mut written) = (0, 0);
    while written < len {
        let step = decoder.decode_bytes(&packed[read..], &mut bytes[written..]);
        (read, written) = (read + step.consumed_in, written + step.consumed_out);
        let is_stuck = step.consumed_in == 0 && step.consumed_out == 0;
        match step.status {
            Ok(LzwStatus::Ok) if !is_stuck => {}
            Ok(_) if written == len => {}
            Ok(_) => {
                return Err(malformed(format!(
                    "a strip or tile packed by LZW ends after {written} of {len} bytes"
                )));
            }
            Err(error) => {
                return Err(malformed(format!(
                    "a strip or tile is not packed by LZW: {error}"
                )));
            }
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use weezl::encode::Encoder;

    use super::*;

    fn packed(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = Encoder::with_tiff_size_switch(BitOrder::Msb, 8);
        encoder.encode(bytes).expect("any bytes can be packed")
    }

    /// Bytes that repeat only after a while.
    fn varied(len: usize) -> Vec<u8> {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24).to_le_bytes()[0] % 23
        };
        (0..len).map(|_| next()).collect()
    }

    #[test]
    fn bytes_come_back_whatever_their_number() {
        let lens = [1, 2, 100, 8_191, 8_192, 8_193, 16_384, 65_536];
        for bytes in lens.map(varied) {
            let packed = packed(&bytes);
            assert!(packed.len() <= LONGEST * bytes.len() + MARKERS);
            assert_eq!(unpack(&packed, bytes.len()).expect("it is whole"), bytes);
            let half = bytes.len() / 2;
            assert_eq!(unpack(&packed, half).expect("it is whole"), bytes[..half]);
        }
    }

    #[test]
    fn a_block_without_its_end_marker_is_read() {
        let bytes = varied(8_192);
        let packed = packed(&bytes);
        let cut = &packed[..packed.len() - 1];
        assert_eq!(
            unpack(cut, bytes.len()).expect("all bytes are there"),
            bytes
        );
    }

    #[test]
    fn a_block_that_ends_early_or_is_no_lzw_is_refused() {
        let bytes = varied(8_192);
        let packed = packed(&bytes);
        for bad in [&packed[..packed.len() / 2], &[][..], &[0xff; 64]] {
            let refused = unpack(bad, bytes.len()).expect_err("it is damaged");
            assert!(refused.to_string().contains("LZW"), "{refused}");
        }
    }
}
