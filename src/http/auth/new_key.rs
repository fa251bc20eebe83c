//! New keys that nobody can guess.

use data_encoding::HEXLOWER;

use super::keys::PREFIX;

/// A new key: 256 random bits.
///
/// # Errors
/// When the operating system provides no random bytes.
pub fn key() -> Result<String, getrandom::Error> {
    let mut bytes = [0_u8; 32];
    getrandom::fill(&mut bytes)?;
    Ok(format!("{PREFIX}{}", HEXLOWER.encode(&bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fresh_keys_are_distinct_and_recognisable() {
        let (one, other) = (key().expect("random"), key().expect("random"));
        assert_ne!(one, other);
        assert_eq!(one.len(), PREFIX.len() + 64);
        assert!(super::super::keys::holds_a_key(&one));
    }
}
