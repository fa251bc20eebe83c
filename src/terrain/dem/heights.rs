//! What the code of a reference system says about heights.
//!
//! The lists follow version 11 of the EPSG registry.

/// Vertical systems whose heights are metres, upwards, from a geoid or from the zero of a levelling network; these are
/// taken as heights above mean sea level. Sorted.
///
/// Deliberately absent: depths, feet, heights above high water, above the water of the moment and above the Caspian
/// Sea, and heights of an oil field.
const ABOVE_SEA_LEVEL: [u16; 219] = [
    3855, 3886, 3900, 4440, 4458, 5193, 5195, 5214, 5237, 5317, 5597, 5600, 5601, 5602, 5603, 5604,
    5605, 5606, 5607, 5608, 5609, 5610, 5613, 5615, 5616, 5617, 5618, 5619, 5620, 5621, 5701, 5703,
    5704, 5705, 5709, 5710, 5711, 5712, 5713, 5714, 5716, 5717, 5718, 5719, 5720, 5721, 5722, 5723,
    5724, 5725, 5726, 5727, 5728, 5729, 5730, 5731, 5732, 5733, 5735, 5736, 5737, 5738, 5740, 5741,
    5742, 5743, 5744, 5745, 5746, 5747, 5748, 5749, 5750, 5751, 5752, 5753, 5755, 5756, 5757, 5758,
    5759, 5760, 5761, 5762, 5763, 5764, 5765, 5766, 5767, 5768, 5769, 5770, 5771, 5772, 5773, 5774,
    5775, 5776, 5777, 5778, 5779, 5780, 5781, 5782, 5783, 5784, 5785, 5786, 5787, 5788, 5791, 5792,
    5793, 5794, 5795, 5796, 5798, 5799, 5843, 5941, 6178, 6179, 6180, 6181, 6182, 6183, 6184, 6185,
    6186, 6187, 6638, 6639, 6640, 6641, 6642, 6643, 6644, 6647, 6693, 6694, 6695, 6916, 7446, 7447,
    7651, 7652, 7699, 7700, 7707, 7832, 7837, 7839, 7841, 7888, 7889, 7890, 7962, 7968, 8089, 8266,
    8267, 8357, 8434, 8675, 8690, 8691, 8841, 8881, 8904, 8911, 9130, 9245, 9255, 9274, 9279, 9303,
    9335, 9351, 9389, 9390, 9392, 9393, 9394, 9395, 9396, 9397, 9398, 9399, 9400, 9401, 9402, 9451,
    9458, 9471, 9650, 9651, 9663, 9666, 9669, 9675, 9681, 9721, 9722, 9923, 9927, 10_190, 10_352,
    10_353, 10_354, 10_482, 10_483, 10_484, 10_485, 10_565, 10_588, 20_000, 20_034, 20_035, 20_036,
];

/// Geographic systems of three dimensions: their heights are above the ellipsoid. Sorted.
const ABOVE_ELLIPSOID: [u16; 251] = [
    3823, 3888, 4017, 4040, 4074, 4080, 4327, 4329, 4339, 4341, 4343, 4345, 4347, 4349, 4351, 4353,
    4355, 4357, 4359, 4361, 4363, 4365, 4367, 4369, 4371, 4373, 4375, 4377, 4379, 4381, 4383, 4386,
    4388, 4466, 4469, 4472, 4480, 4482, 4557, 4883, 4885, 4887, 4889, 4891, 4893, 4895, 4898, 4900,
    4907, 4909, 4921, 4923, 4925, 4927, 4929, 4931, 4933, 4935, 4937, 4939, 4941, 4943, 4945, 4947,
    4949, 4951, 4953, 4955, 4957, 4959, 4961, 4963, 4965, 4967, 4969, 4971, 4973, 4975, 4977, 4979,
    4981, 4983, 4985, 4987, 4989, 4991, 4993, 4995, 4997, 4999, 5012, 5245, 5251, 5263, 5323, 5342,
    5353, 5359, 5364, 5370, 5372, 5380, 5392, 5488, 5545, 5560, 5592, 5830, 5885, 6134, 6310, 6319,
    6321, 6324, 6364, 6667, 6705, 6782, 6979, 6982, 6986, 6989, 7034, 7036, 7038, 7040, 7042, 7072,
    7085, 7087, 7135, 7138, 7372, 7657, 7659, 7661, 7663, 7665, 7678, 7680, 7682, 7685, 7797, 7816,
    7843, 7880, 7885, 7900, 7901, 7902, 7903, 7904, 7905, 7906, 7907, 7908, 7909, 7910, 7911, 7912,
    7915, 7917, 7919, 7921, 7923, 7925, 7927, 7929, 7931, 8085, 8231, 8235, 8239, 8244, 8248, 8251,
    8254, 8399, 8403, 8426, 8430, 8542, 8544, 8684, 8698, 8817, 8899, 8901, 8906, 8916, 8918, 8920,
    8922, 8924, 8926, 8928, 8930, 8932, 8934, 8936, 8938, 8940, 8942, 8944, 8946, 8948, 9002, 9005,
    9008, 9011, 9013, 9016, 9018, 9071, 9074, 9139, 9147, 9152, 9183, 9267, 9293, 9308, 9332, 9379,
    9469, 9546, 9695, 9701, 9754, 9776, 9778, 9781, 9783, 9893, 9989, 10_177, 10_283, 10_298,
    10_300, 10_304, 10_309, 10_311, 10_327, 10_413, 10_474, 10_570, 10_605, 10_670, 10_672, 20_040,
    20_045,
];

/// The vertical systems of `GeoTIFF` 1.0 that are named after an ellipsoid.
const ELLIPSOIDS: std::ops::RangeInclusive<u16> = 5001..=5033;

/// Whether the heights of a vertical system are metres above sea level.
pub(super) fn are_above_sea_level(vertical: u16) -> bool {
    ABOVE_SEA_LEVEL.binary_search(&vertical).is_ok()
}

/// Whether a geographic system states heights, which are then above the ellipsoid.
pub(super) fn are_above_ellipsoid(geographic: u16) -> bool {
    ABOVE_ELLIPSOID.binary_search(&geographic).is_ok()
}

/// Whether a `GeoTIFF`'s vertical system means heights above the ellipsoid.
pub(super) fn stand_for_ellipsoid(vertical: u16) -> bool {
    ELLIPSOIDS.contains(&vertical) || are_above_ellipsoid(vertical)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_code_is_found_in_one_list_at_most() {
        assert!(ABOVE_SEA_LEVEL.is_sorted() && ABOVE_ELLIPSOID.is_sorted());
        for code in 0..=u16::MAX {
            assert!(
                !(are_above_sea_level(code) && stand_for_ellipsoid(code)),
                "EPSG:{code}"
            );
        }
        // EGM 96, EGM 2008, NAVD 88, Amsterdam; feet, depths, the Caspian Sea.
        assert!(
            [5773, 3855, 5703, 5709]
                .into_iter()
                .all(are_above_sea_level)
        );
        assert!(
            ![6360, 8228, 5715, 5611]
                .into_iter()
                .any(are_above_sea_level)
        );
        assert!(
            [4979, 4937, 6319, 5030]
                .into_iter()
                .all(stand_for_ellipsoid)
        );
    }
}
