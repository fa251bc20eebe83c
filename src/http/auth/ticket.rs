//! Tickets: with one, a browser's `EventSource`, which cannot send headers, can follow one plan.
//!
//! They are not stored. Each states under which key it was issued and until when, signed with that key's sum, which
//! every node has read from the same file: so a ticket from one node is valid on all of them, and ends with its key.

use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD as BASE64;
use hmac::{Hmac, KeyInit as _, Mac as _};
use sha2::Sha256;

use super::Unauthorized;
use super::keys::{Key, Keys};
use crate::job::PlanId;

/// Prefix of what is signed, so that nothing else signed with a key's sum can be taken for a ticket.
const LABEL: &[u8] = b"noctule ticket ";

/// Signing key where no keys are in use: there everybody may follow every plan, and there is nothing to forge.
const NOBODY_S: [u8; 32] = [0; 32];

/// A ticket for the plan's events until then, in the name of `key`; `None` where no keys are in use.
pub(super) fn issue(plan: PlanId, key: Option<&Key>, until_ms: i64) -> String {
    let until = until_ms.to_be_bytes();
    let tag = signing(plan, key, until).finalize().into_bytes();
    let name = key.map_or("", |key| &key.name);
    BASE64.encode([until.as_slice(), tag.as_slice(), name.as_bytes()].concat())
}

/// The key in whose name `text` is a ticket for the plan; `None` where no keys are in use.
///
/// # Errors
/// [`Unauthorized::NoTicket`] when it is invalid or has expired.
pub(super) fn holder<'k>(
    text: &str,
    plan: PlanId,
    keys: Option<&'k Keys>,
    now_ms: i64,
) -> Result<Option<&'k Key>, Unauthorized> {
    let bytes = BASE64.decode(text).ok();
    let parts = bytes.as_deref().and_then(parts);
    let (until, tag, name) = parts.ok_or(Unauthorized::NoTicket)?;
    let key = match keys {
        Some(keys) => Some(keys.named(name).ok_or(Unauthorized::NoTicket)?),
        None => None,
    };
    // Compares in constant time, which reveals nothing about how much of it is right.
    let signed = signing(plan, key, until).verify_slice(tag).is_ok();
    if signed && i64::from_be_bytes(until) > now_ms {
        Ok(key)
    } else {
        Err(Unauthorized::NoTicket)
    }
}

/// Expiry time, tag, and name of the key.
fn parts(bytes: &[u8]) -> Option<([u8; 8], &[u8; 32], &str)> {
    let (until, rest) = bytes.split_first_chunk()?;
    let (tag, name) = rest.split_first_chunk()?;
    Some((*until, tag, std::str::from_utf8(name).ok()?))
}

fn signing(plan: PlanId, key: Option<&Key>, until: [u8; 8]) -> Hmac<Sha256> {
    let secret = key.map_or(NOBODY_S, Key::digest);
    let mut mac = Hmac::new_from_slice(&secret).expect("a key of HMAC has any length");
    mac.update(LABEL);
    mac.update(plan.as_bytes());
    mac.update(&until);
    mac
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::new_id;

    /// A key file with one key.
    fn keys(name: &str, digit: char) -> Keys {
        let sum = digit.to_string().repeat(64);
        let text = format!("[[key]]\nname = {name:?}\nsha256 = \"{sum}\"\nscopes = [\"read\"]\n");
        Keys::read(&text).expect("a key")
    }

    #[test]
    fn a_ticket_is_bound_to_one_plan_one_key_and_a_time() {
        let (ours, plan) = (keys("ä", '1'), new_id(0));
        let key = ours.named("ä");
        let ticket = issue(plan, key, 600_000);
        let holds = |text: &str, plan, keys: &Keys, now_ms| {
            let holder = holder(text, plan, Some(keys), now_ms);
            holder.is_ok_and(|holder| holder.is_some())
        };
        assert!(holds(&ticket, plan, &ours, 0));
        assert!(holds(&ticket, plan, &ours, 599_999), "again");
        assert!(holds(&ticket, plan, &keys("ä", '1'), 0), "on any node");
        assert!(!holds(&ticket, plan, &ours, 600_000));
        assert!(!holds(&ticket, new_id(0), &ours, 0));
        assert!(!holds(&ticket, plan, &keys("ä", '2'), 0), "a changed key");
        assert!(!holds(&ticket, plan, &keys("o", '1'), 0), "no such key");
        assert!(holder(&ticket, plan, None, 0).is_err());
        assert!(!holds(&issue(plan, None, 600_000), plan, &ours, 0));
    }

    #[test]
    fn a_ticket_with_a_changed_bit_or_cut_short_is_refused() {
        let (keys, plan) = (keys("a", '1'), new_id(0));
        let ticket = issue(plan, keys.named("a"), 600_000);
        let bytes = BASE64.decode(&ticket).expect("of this alphabet");
        for bit in 0..bytes.len() * 8 {
            let mut forged = bytes.clone();
            forged[bit / 8] ^= 1 << (bit % 8);
            let forged = BASE64.encode(forged);
            assert!(holder(&forged, plan, Some(&keys), 0).is_err(), "{bit}");
        }
        for length in 0..ticket.len() {
            let part = &ticket[..length];
            assert!(holder(part, plan, Some(&keys), 0).is_err(), "{part}");
        }
    }

    #[test]
    fn without_keys_a_ticket_is_still_bound_to_its_plan_and_time() {
        let plan = new_id(0);
        let ticket = issue(plan, None, 600_000);
        assert_eq!(holder(&ticket, plan, None, 599_999), Ok(None));
        for (text, plan, now_ms) in [
            (&*ticket, plan, 600_000),
            (&*ticket, new_id(0), 0),
            ("x", plan, 0),
        ] {
            let refused = holder(text, plan, None, now_ms);
            assert_eq!(refused, Err(Unauthorized::NoTicket), "{text}");
        }
    }
}
