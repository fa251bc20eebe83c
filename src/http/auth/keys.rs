//! The keys in force, and finding the one a caller has sent.
//!
//! Only hashes are kept. A key is 256 random bits, so it cannot be guessed and a slow hash would gain nothing: SHA-256
//! hides it as well, and costs each request less than a microsecond.

use std::collections::HashSet;
use std::fmt;

use jiff::Timestamp;
use percent_encoding::percent_decode_str;
use sha2::{Digest as _, Sha256};
use subtle::{Choice, ConditionallySelectable as _, ConstantTimeEq as _};

use super::key_file;
use super::rate::Rate;
use super::scope::Scope;
use crate::job::Owner;

/// Prefix of every key, so that people and scanners recognise one.
pub(super) const PREFIX: &str = "noctule_";

/// A SHA-256 sum.
pub(in crate::http) type Digest = [u8; 32];

/// A key in force.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// Its name for people.
    pub name: String,
    /// Whose plans it gives access to; several keys may share an owner.
    pub owner: Owner,
    /// What it may do.
    pub scopes: Vec<Scope>,
    /// From then on it is not valid.
    pub expires: Option<Timestamp>,
    /// Active plans that its owner may have.
    pub active_plans: Option<u64>,
    /// Rate at which it may send requests.
    pub rate: Option<Rate>,
    /// Sum of the whole key, prefix included.
    pub(super) sha256: Digest,
}

impl Key {
    pub(in crate::http) fn may(&self, asked: Scope) -> bool {
        self.scopes.iter().any(|scope| scope.includes(asked))
    }

    pub(in crate::http) fn digest(&self) -> Digest {
        self.sha256
    }

    pub(super) fn has_expired(&self, now: Timestamp) -> bool {
        self.expires.is_some_and(|expires| expires <= now)
    }
}

/// The keys in force.
#[derive(Debug, Clone, PartialEq)]
pub struct Keys(Vec<Key>);

/// Why a file of keys is refused: all its faults, naming the entries.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct KeysError(pub Vec<String>);

impl fmt::Display for KeysError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}", self.0.join("; "))
    }
}

impl Keys {
    /// Read the text of a file of keys.
    ///
    /// # Errors
    /// Everything that is wrong with it: invalid TOML, unknown fields and scopes, invalid SHA-256 sums, duplicate names
    /// and sums, and a file without a key.
    pub fn read(text: &str) -> Result<Self, KeysError> {
        let (keys, mut faults) = key_file::read(text);
        let (mut names, mut sums) = (HashSet::new(), HashSet::new());
        for key in &keys {
            if !names.insert(&key.name) {
                faults.push(format!("two keys have the name {:?}", key.name));
            }
            if !sums.insert(key.sha256) {
                faults.push(format!("key {:?} has the sha256 of another one", key.name));
            }
        }
        if keys.is_empty() && faults.is_empty() {
            faults.push("there is no [[key]]".to_owned());
        }
        if faults.is_empty() {
            Ok(Self(keys))
        } else {
            Err(KeysError(faults))
        }
    }

    /// How many.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "there is always one")]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The key that matches `secret`. Takes the same time whichever matches, or none.
    pub(super) fn find(&self, secret: &[u8]) -> Option<&Key> {
        self.with_digest(&digest(secret))
    }

    pub(super) fn with_digest(&self, digest: &Digest) -> Option<&Key> {
        let (mut found, mut place) = (Choice::from(0), 0_u32);
        for (position, key) in (0_u32..).zip(&self.0) {
            let same = key.sha256.ct_eq(digest);
            place.conditional_assign(&position, same);
            found |= same;
        }
        bool::from(found).then(|| &self.0[place as usize])
    }

    pub(super) fn named(&self, name: &str) -> Option<&Key> {
        self.0.iter().find(|key| key.name == name)
    }

    pub(super) fn names(&self) -> HashSet<&str> {
        self.0.iter().map(|key| key.name.as_str()).collect()
    }
}

pub(super) fn digest(secret: &[u8]) -> Digest {
    Sha256::digest(secret).into()
}

/// Whether `text` contains what looks like a key, percent-encoded or not.
pub(in crate::http) fn holds_a_key(text: &str) -> bool {
    let decoded = percent_decode_str(text).decode_utf8_lossy();
    looks_like_a_key(text) || looks_like_a_key(&decoded)
}

fn looks_like_a_key(text: &str) -> bool {
    /// Characters of a key that suffice: even half a key in a log is too much.
    const ENOUGH: usize = 16;
    text.match_indices(PREFIX).any(|(start, _)| {
        let rest = text[start + PREFIX.len()..].bytes();
        rest.take_while(u8::is_ascii_hexdigit).count() >= ENOUGH
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::digest::sha256_hex;

    #[test]
    fn each_key_is_found_and_no_other() {
        let entries: Vec<String> = (0..5)
            .map(|n| {
                let sum = sha256_hex(format!("secret {n}").as_bytes());
                format!("[[key]]\nname = \"k{n}\"\nsha256 = \"{sum}\"\nscopes = [\"read\"]\n")
            })
            .collect();
        let keys = Keys::read(&entries.concat()).expect("five keys");
        for n in 0..5 {
            let found = keys.find(format!("secret {n}").as_bytes());
            assert_eq!(found.map(|key| key.name.clone()), Some(format!("k{n}")));
        }
        for wrong in ["", "secret", "secret 5", "secret 0 "] {
            assert_eq!(keys.find(wrong.as_bytes()), None, "{wrong:?}");
        }
    }

    #[test]
    fn a_key_is_recognised_inside_a_url() {
        let key = format!("{PREFIX}{}", "0a".repeat(32));
        assert!(holds_a_key(&key));
        assert!(holds_a_key(&format!("/plans/{key}/x")));
        assert!(holds_a_key(&key.replace('_', "%5f")));
        assert!(holds_a_key(&key.replace('n', "%6E")));
        assert!(!holds_a_key("100%, %zz, %5"));
        assert!(!holds_a_key("/terrains/noctule_alps"));
        assert!(!holds_a_key("/plans"));
    }
}
