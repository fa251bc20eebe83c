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

/// Most secrets at once: the old and the new one, and room for another.
const MOST: usize = 3;

/// The secrets that the operator shares with receivers: one, or several while receivers move from one to the next.
#[derive(Clone, PartialEq, Eq)]
pub struct Secrets(Vec<Vec<u8>>);

impl Secrets {
    /// Read the text of a file: one secret a line, each `whsec_` and 24 to 64 bytes in base64.
    ///
    /// # Errors
    /// The allowed form, without repeating any of the text.
    pub fn read(text: &str) -> Result<Self, &'static str> {
        const ALLOWED: &str = "must be one to three lines of whsec_ and 24 to 64 bytes in base64, \
                               such as whsec_$(openssl rand -base64 32)";
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
        let secrets: Option<Vec<_>> = lines.map(secret).collect();
        let secrets = secrets.filter(|secrets| (1..=MOST).contains(&secrets.len()));
        secrets.map(Self).ok_or(ALLOWED)
    }

    /// The value of `webhook-signature`: one signature for each secret, any of which a receiver may verify.
    pub(super) fn sign(&self, id: &str, timestamp_s: i64, body: &str) -> String {
        let signed = format!("{id}.{timestamp_s}.{body}");
        let signature = |secret: &Vec<u8>| {
            let mut mac =
                Hmac::<Sha256>::new_from_slice(secret).expect("a key of HMAC has any length");
            mac.update(signed.as_bytes());
            format!("v1,{}", BASE64.encode(mac.finalize().into_bytes()))
        };
        let signatures: Vec<String> = self.0.iter().map(signature).collect();
        signatures.join(" ")
    }
}

fn secret(line: &str) -> Option<Vec<u8>> {
    let bytes = BASE64.decode(line.strip_prefix(PREFIX)?).ok()?;
    LENGTHS.contains(&bytes.len()).then_some(bytes)
}

impl fmt::Debug for Secrets {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("Secrets(..)")
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
            (format!("{}\n{}\r\n\n", coded(24), coded(32)), true),
            ([24; 4].map(coded).join("\n"), false),
            (coded(24) + "\nwhsec_", false),
            (String::new(), false),
            (coded(23), false),
            (coded(65), false),
            ("whsec_".to_owned(), false),
            ("whsec_!".to_owned(), false),
            (BASE64.encode([7; 32]), false),
        ] {
            assert_eq!(Secrets::read(&text).is_ok(), taken, "{text}");
        }
        let secret = Secrets::read(&coded(24)).expect("a secret");
        assert_eq!(format!("{secret:?}"), "Secrets(..)");
    }

    /// The expected signature is from `openssl dgst -sha256 -hmac`.
    #[test]
    fn the_signature_covers_id_time_and_body() {
        const TEXT: &str = "whsec_MDEyMzQ1Njc4OWFiY2RlZjAxMjM0NTY3ODlhYmNkZWY=";
        const SIGNATURE: &str = "v1,rkwp5YuvdrMkcu0ZhuMsXoTg44mHAr1Q0+FFgFpXsjY=";
        let sign = |text: &str| {
            let secrets = Secrets::read(text).expect("secrets");
            secrets.sign("msg_1", 1_700_000_000, "{\"a\":1}")
        };
        assert_eq!(sign(TEXT), SIGNATURE);
        let other = format!("whsec_{}", BASE64.encode([7; 24]));
        let both = sign(&format!("{other}\n{TEXT}\n"));
        assert_eq!(both, format!("{} {SIGNATURE}", sign(&other)));
    }
}
