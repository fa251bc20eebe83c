//! Shifts of datums to WGS 84 that the library's definitions of reference systems have wrong.
//!
//! All systems that the program accepts were compared with PROJ 9.5 and version 11 of the EPSG registry, at many places
//! of their areas. Where the definition is more than two metres further off than the registry says its own shift is, and
//! the registry has a single shift for the whole area, that one replaces the library's. The others are refused: their
//! areas are divided between several shifts, or their projection is another one than the definition's.

/// Shifts as `+towgs84` has them, and the codes of the systems that they belong to.
const MENDED: [(&str, &[u16]); 22] = [
    // St. Lucia 1955.
    ("+towgs84=-153,153,307", &[2006, 4606]),
    // Israel 1993 and IG05/12 Intermediate CRS.
    (
        "+towgs84=23.772,17.49,17.859,-0.3132,-1.85274,1.67299,-5.4262",
        &[2039, 4141, 6990, 6991],
    ),
    // ED50(ED77).
    (
        "+towgs84=-110.33,-97.73,-119.85,0.3423,1.1634,0.2715,0.063",
        &[2058, 2059, 2060, 2061, 4154],
    ),
    // Pampa del Castillo.
    ("+towgs84=-233.43,6.65,173.64", &[2082, 4161]),
    // Hito XVIII 1963.
    (
        "+towgs84=18.38,192.45,96.82,0.056,-0.142,-0.2,-0.0013",
        &[2083],
    ),
    // Qornoq 1927.
    (
        "+towgs84=163.511,127.533,-159.789,0,0,0.814,-0.6",
        &[2216, 4194],
    ),
    // Segara.
    ("+towgs84=-404.78,685.68,45.47", &[2933]),
    // Fatu Iva 72.
    (
        "+towgs84=347.175,1077.618,2623.677,33.9058,-70.6776,9.4013,186.0647",
        &[3303, 4688],
    ),
    // Moorea 87.
    (
        "+towgs84=218.769,150.75,176.75,3.5231,2.0037,1.288,10.9817",
        &[3305, 4691],
    ),
    // Pulkovo 1942(58).
    (
        "+towgs84=2.329,-147.042,-92.08,-0.309,0.325,0.497,5.69",
        &[3844],
    ),
    // MGI 1901.
    (
        "+towgs84=551.7,162.9,467.9,6.04,1.96,-11.38,-4.82",
        &[3907, 3911, 3912, 8677],
    ),
    // Fahud.
    ("+towgs84=-345,3,223", &[4232, 23_240]),
    // ID74.
    (
        "+towgs84=-1.977,-13.06,-9.993,0.364,0.254,0.689,-1.037",
        &[4238, 23_893, 23_894],
    ),
    // Indian 1975.
    ("+towgs84=293,836,318,0.5,1.6,-2.8,2.1", &[24_047]),
    // JAD69.
    (
        "+towgs84=-33.722,153.789,94.959,-8.581,-4.478,4.54,8.95",
        &[4242, 24_200],
    ),
    // Tananarive and Tananarive (Paris).
    (
        "+towgs84=-198.383,-240.517,-107.909",
        &[4297, 29_700, 29_702, 29_738, 29_739],
    ),
    // Nord Sahara 1959.
    (
        "+towgs84=-267.407,-47.068,446.357,-0.179423,5.577661,-1.27762,1.204866",
        &[4307, 30_729, 30_730, 30_731, 30_732, 30_792],
    ),
    // Yacare.
    (
        "+towgs84=-124.45,183.74,44.64,-0.4384,0.5446,-0.9706,-2.1365",
        &[4309],
    ),
    // UCS-2000.
    (
        "+towgs84=24,-121,-76",
        &[
            5561, 5562, 5563, 5564, 5565, 5566, 5567, 5568, 5569, 5570, 5571, 5572, 5573, 5574,
            5575, 5576, 5577, 5578, 5579, 5580, 5581, 5582, 5583, 6381, 6382, 6383, 6384, 6385,
            6386, 6387,
        ],
    ),
    // South East Island 1943.
    (
        "+towgs84=-76.269,-16.683,68.562,-6.275,10.536,-4.286,-13.686",
        &[6892, 6915],
    ),
    // Bogota 1975.
    (
        "+towgs84=221.899,274.136,-397.554,-2.80844591,0.4485085889,2.810172347,-2.199943",
        &[21_894, 21_899],
    ),
    // MGI (Ferro).
    (
        "+towgs84=577.326,90.129,463.919,5.137,1.474,5.297,2.4232",
        &[
            31_281, 31_282, 31_283, 31_288, 31_289, 31_290, 31_291, 31_292, 31_293,
        ],
    ),
];

/// Systems whose definition is off in a part of their area at least, by two metres to kilometres. Sorted.
const WRONG: [u16; 162] = [
    2065, 2084, 2170, 2206, 2207, 2208, 2209, 2210, 2211, 2212, 2217, 2317, 2318, 2319, 2320, 2321,
    2322, 2323, 2324, 2325, 2412, 2433, 2736, 2737, 2938, 2978, 3000, 3004, 3066, 3200, 3302, 3331,
    3334, 3787, 3893, 3906, 3908, 3909, 3910, 3973, 3974, 3975, 4055, 4127, 4132, 4144, 4145, 4156,
    4179, 4204, 4208, 4209, 4218, 4227, 4229, 4230, 4240, 4248, 4254, 4263, 4265, 4270, 4282, 4613,
    4618, 4630, 4689, 4740, 4805, 4818, 4923, 5221, 5337, 5451, 5456, 5457, 5462, 5463, 5513, 5514,
    6200, 6204, 6316, 6871, 6983, 6984, 6996, 6997, 8678, 8679, 20_438, 20_822, 20_823, 20_824,
    20_934, 20_935, 20_936, 21_818, 21_891, 21_892, 21_893, 21_896, 21_897, 21_898, 22_700, 22_770,
    22_780, 22_991, 22_992, 22_993, 22_994, 23_029, 23_030, 23_031, 23_032, 23_033, 23_034, 23_035,
    23_036, 23_037, 23_038, 23_090, 24_048, 24_305, 24_306, 24_312, 24_375, 24_377, 24_817, 24_820,
    24_877, 24_878, 24_879, 24_880, 24_881, 24_882, 24_891, 24_892, 26_331, 26_332, 26_391, 26_392,
    27_039, 28_232, 29_101, 29_168, 29_169, 29_170, 29_171, 29_187, 29_188, 29_189, 30_791, 31_265,
    31_266, 31_267, 31_268, 31_275, 31_276, 31_277, 31_278, 31_279,
];

/// Geographic systems whose coordinates are in grads. Sorted.
const IN_GRADS: [u16; 8] = [4807, 4810, 4811, 4816, 4819, 4821, 4901, 4902];

/// The shift of a system, where its definition has another.
pub(super) fn mended(code: u16) -> Option<&'static str> {
    let entry = MENDED.iter().find(|(_, codes)| codes.contains(&code));
    entry.map(|(shift, _)| *shift)
}

/// Why the definition of a system cannot be used.
pub(super) fn refusal(code: u16) -> Option<&'static str> {
    if IN_GRADS.binary_search(&code).is_ok() {
        Some("its coordinates are in grads, must be in degrees")
    } else if WRONG.binary_search(&code).is_ok() {
        Some(
            "its shift to WGS 84 or its projection is not known well enough; rewrite the file in another one, such as by gdalwarp -t_srs EPSG:4326",
        )
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_system_is_both_mended_and_refused() {
        assert!(WRONG.is_sorted() && IN_GRADS.is_sorted());
        let codes: Vec<u16> = MENDED
            .iter()
            .flat_map(|(_, codes)| *codes)
            .copied()
            .collect();
        for (idx, code) in codes.iter().enumerate() {
            assert!(refusal(*code).is_none(), "EPSG:{code}");
            assert!(!codes[..idx].contains(code), "EPSG:{code}");
        }
    }
}
