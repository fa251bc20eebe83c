//! How receivers verify a webhook: a Standard Webhooks signature over id, time and body.

use std::fmt;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use hmac::{Hmac, KeyInit as _, Mac as _};
use sha2::Sha256;

/// Prefix of a secret's text form.
const PREFIX: &str = "whsec_";

/// Lengths of secrets, bytes, as Standard Webhooks requires.
const LENGTHS: std::ops::RangeInclusive<usize> = 24..=64;

/// The secret that the operator shares with receivers.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(Vec<u8>);

impl Secret {
    /// Read the text of a file: `whsec_` and 24 to 64 bytes in base64.
    ///
    /// # Errors
    /// The allowed form, without repeating any of the text.
    pub fn read(text: &str) -> Result<Self, &'static str> {
        const ALLOWED: &str =
            "must be whsec_ and 24 to 64 bytes in base64, such as whsec_$(openssl rand -base64 32)";
        let coded = text.trim().strip_prefix(PREFIX).ok_or(ALLOWED)?;
        let bytes = BASE64.decode(coded).map_err(|_| ALLOWED)?;
        if LENGTHS.contains(&bytes.len()) {
            Ok(Self(bytes))
        } else {
            Err(ALLOWED)
        }
    }

    /// The value of `webhook-signature`.
    pub(super) fn sign(&self, id: &str, timestamp_s: i64, body: &str) -> String {
        let mut mac =
            Hmac::<Sha256>::new_from_slice(&self.0).expect("a key of HMAC has any length");
        mac.update(format!("{id}.{timestamp_s}.{body}").as_bytes());
        format!("v1,{}", BASE64.encode(mac.finalize().into_bytes()))
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("Secret(..)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_secrets_of_valid_length_are_accepted() {
        let coded = |bytes: usize| format!("whsec_{}", BASE64.encode(vec![7_u8; bytes]));
        for (text, taken) in [
            (coded(24), true),
            (coded(64) + "\n", true),
            (coded(23), false),
            (coded(65), false),
            ("whsec_".to_owned(), false),
            ("whsec_!".to_owned(), false),
            (BASE64.encode([7; 32]), false),
        ] {
            assert_eq!(Secret::read(&text).is_ok(), taken, "{text}");
        }
        let secret = Secret::read(&coded(24)).expect("a secret");
        assert_eq!(format!("{secret:?}"), "Secret(..)");
    }

    /// The expected signature is from `openssl dgst -sha256 -hmac`.
    #[test]
    fn the_signature_covers_id_time_and_body() {
        let secret =
            Secret::read("whsec_MDEyMzQ1Njc4OWFiY2RlZjAxMjM0NTY3ODlhYmNkZWY=").expect("a secret");
        let signature = secret.sign("msg_1", 1_700_000_000, "{\"a\":1}");
        assert_eq!(signature, "v1,rkwp5YuvdrMkcu0ZhuMsXoTg44mHAr1Q0+FFgFpXsjY=");
    }
}
