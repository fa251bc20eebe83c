//! A delivered plan in the formats that people take away.

pub mod document;
