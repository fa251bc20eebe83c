//! What a document may name that must be looked up elsewhere, as its text alone tells.

/// The field by which a scenario names a dataset, which is read from files.
pub(super) const DATASET: &str = "dataset";

/// The field by which a scenario names a plan to start from, which is read from the store.
pub(super) const PLAN: &str = "plan_id";

/// Whether a document may have this field: escapes can hide it. Invalid text is refused before it is looked up.
pub(super) fn may_name(document: &[u8], field: &str) -> bool {
    str::from_utf8(document).is_ok_and(|text| text.contains('\\') || text.contains(field))
}
