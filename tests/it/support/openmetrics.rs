//! The response of `GET /metrics`, parsed as strictly as the format specifies.

use std::collections::{BTreeMap, BTreeSet};

/// The metrics of one response.
#[derive(Debug)]
pub(crate) struct Reading {
    /// Names of families, with their types.
    pub(crate) families: BTreeMap<String, String>,
    /// Series as written, `name{label="value"}`, with their values.
    pub(crate) series: BTreeMap<String, f64>,
}

impl Reading {
    /// Panics at the first line that is not valid `OpenMetrics`.
    pub(crate) fn read(text: &str) -> Self {
        let mut lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.pop(), Some("# EOF"), "the end is marked");
        assert!(text.ends_with('\n'));
        let mut reading = Self {
            families: BTreeMap::new(),
            series: BTreeMap::new(),
        };
        let mut family = (String::new(), String::new());
        for line in lines {
            if let Some(declared) = line.strip_prefix("# TYPE ") {
                let (name, kind) = declared.split_once(' ').expect("a name and a type");
                let again = reading.families.insert(name.to_owned(), kind.to_owned());
                assert_eq!(again, None, "{name} is declared twice");
                family = (name.to_owned(), kind.to_owned());
            } else if let Some(unit) = line.strip_prefix("# UNIT ") {
                let (name, unit) = unit.split_once(' ').expect("a name and a unit");
                assert!(name.ends_with(&format!("_{unit}")), "{line}");
            } else if let Some(help) = line.strip_prefix("# HELP ") {
                assert!(help.ends_with('.'), "{line}");
            } else {
                let (series, value) = line.rsplit_once(' ').expect("a series and a value");
                let value: f64 = value.parse().unwrap_or_else(|_| panic!("{line}"));
                check_name(series, &family);
                let again = reading.series.insert(series.to_owned(), value);
                assert_eq!(again, None, "{series} twice");
            }
        }
        reading.check_histograms();
        reading
    }

    /// The value of one series.
    #[track_caller]
    pub(crate) fn value(&self, series: &str) -> f64 {
        let value = self.series.get(series);
        *value.unwrap_or_else(|| panic!("no {series} in {:#?}", self.series.keys()))
    }

    /// Names of series without their labels.
    pub(crate) fn names(&self) -> BTreeSet<&str> {
        let names = self.series.keys().map(|series| name(series));
        names.collect()
    }

    /// Bucket counts must not decrease, and the last one must equal the total.
    fn check_histograms(&self) {
        for (family, _) in self
            .families
            .iter()
            .filter(|(_, kind)| *kind == "histogram")
        {
            let mut last: BTreeMap<String, (f64, f64)> = BTreeMap::new();
            let mut buckets: Vec<(String, f64, f64)> = Vec::new();
            for (series, count) in &self.series {
                if name(series) == format!("{family}_bucket") {
                    let (total, bound) = without_bound(series);
                    buckets.push((total, bound, *count));
                }
            }
            buckets.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            for (labels, bound, count) in buckets {
                if let Some((_, below)) = last.insert(labels.clone(), (bound, count)) {
                    assert!(below <= count, "{labels} {bound}");
                }
            }
            for (total, (bound, count)) in last {
                assert!(bound.is_infinite(), "{total}");
                assert!((count - self.value(&total)).abs() < 0.5, "{total}");
            }
        }
    }
}

/// The `_count` series of this bucket's histogram, and the bucket's bound.
fn without_bound(bucket: &str) -> (String, f64) {
    let (name, labels) = bucket.split_once("_bucket{").expect("a bucket");
    let labels = labels.trim_end_matches('}').split(',');
    let (bounds, others): (Vec<&str>, Vec<&str>) =
        labels.partition(|label| label.starts_with("le="));
    let [bound] = *bounds else {
        panic!("{bucket} has {} bounds", bounds.len());
    };
    let bound = bound.trim_start_matches("le=").trim_matches('"');
    let bound = bound.replace("+Inf", "inf").parse().expect("a number");
    let total = if others.is_empty() {
        format!("{name}_count")
    } else {
        format!("{name}_count{{{}}}", others.join(","))
    };
    (total, bound)
}

fn name(series: &str) -> &str {
    series.split('{').next().expect("one part at least")
}

/// A series must belong to the family declared above it, with a suffix of its type.
fn check_name(series: &str, (family, kind): &(String, String)) {
    let suffixes: &[&str] = match kind.as_str() {
        "counter" => &["_total"],
        "gauge" => &[""],
        "info" => &["_info"],
        "histogram" => &["_bucket", "_sum", "_count"],
        other => panic!("{family} is of type {other}"),
    };
    let known = suffixes
        .iter()
        .any(|suffix| name(series) == format!("{family}{suffix}"));
    assert!(known, "{series} is no series of {family}, a {kind}");
    assert!(name(series).starts_with("noctule_"), "{series}");
}
