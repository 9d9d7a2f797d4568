//! Secrets of tokens, sessions and signed links: 256 random bits, written as 43 letters and digits. A secret
//! is shown once and stored as SHA-256. Comparisons take constant time, so that their duration does not
//! reveal the position of a difference.

use std::hint::black_box;
use std::io;

use sha2::{Digest, Sha256};

const DIGITS: &[u8; 62] = b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz";
/// Prefix of a token, by which scanners recognize leaked secrets.
const PREFIX: &str = "frl";
/// Number of letters of a secret, because 62^43 > 2^256.
const SECRET_LETTERS: usize = 43;
const ID_BYTES: usize = 8;
/// Number of letters of an id, because 62^11 > 2^64.
const ID_LETTERS: usize = 11;

/// A token as sent by its holder: `frl_<id>_<secret>`.
#[derive(Clone, PartialEq, Eq)]
pub struct Presented {
    /// Id of the token's row.
    pub id: String,
    /// SHA-256 of the secret.
    pub sha256: [u8; 32],
}

/// A new secret and its hash.
pub(super) struct Secret {
    /// The secret; shown once and not stored.
    pub text: String,
    /// SHA-256 of the secret; stored.
    pub sha256: [u8; 32],
}

impl Presented {
    /// Parses a token. Returns `None` if the text is not a token.
    pub fn parse(text: &str) -> Option<Presented> {
        let (id, secret) = text
            .strip_prefix(PREFIX)?
            .strip_prefix('_')?
            .split_once('_')?;
        let is_part = |part: &str, n: usize| {
            part.len() == n && part.bytes().all(|byte| byte.is_ascii_alphanumeric())
        };
        let is_token = is_part(id, ID_LETTERS) && is_part(secret, SECRET_LETTERS);
        is_token.then(|| Presented {
            id: id.to_owned(),
            sha256: hash(secret),
        })
    }
}

impl Secret {
    /// Creates a secret from 32 bytes of the system's random generator.
    pub(super) fn random() -> io::Result<Secret> {
        let text = base62(&random_key()?, SECRET_LETTERS);
        Ok(Secret {
            sha256: hash(&text),
            text,
        })
    }
}

/// Creates the public id of a token.
pub(super) fn random_id() -> io::Result<String> {
    let mut bytes = [0; ID_BYTES];
    fill_random(&mut bytes)?;
    Ok(base62(&bytes, ID_LETTERS))
}

/// Returns 32 bytes of the system's random generator.
pub(in crate::store) fn random_key() -> io::Result<[u8; 32]> {
    let mut bytes = [0; 32];
    fill_random(&mut bytes)?;
    Ok(bytes)
}

/// Returns HMAC-SHA-256 of a message (RFC 2104), for keys of at most 64 bytes.
pub fn hmac_sha256(key: &[u8], message: &[u8]) -> [u8; 32] {
    let pad = |with: u8| {
        let mut block = [with; 64];
        block.iter_mut().zip(key).for_each(|(pad, key)| *pad ^= key);
        block
    };
    let inner = Sha256::new().chain_update(pad(0x36)).chain_update(message);
    let outer = Sha256::new().chain_update(pad(0x5c));
    outer.chain_update(inner.finalize()).finalize().into()
}

/// Returns the text of a token, made of its id and its secret.
pub(super) fn token_text(id: &str, secret: &str) -> String {
    format!("{PREFIX}_{id}_{secret}")
}

/// Returns SHA-256 of a secret.
pub(super) fn hash(secret: &str) -> [u8; 32] {
    Sha256::digest(secret.as_bytes()).into()
}

/// Returns whether two secrets or hashes are equal. Always compares all bytes of the shorter one.
pub fn is_same(a: &[u8], b: &[u8]) -> bool {
    let differing = a
        .iter()
        .zip(b)
        .fold(0, |bits, (a, b)| black_box(bits | (a ^ b)));
    a.len() == b.len() && differing == 0
}

fn fill_random(bytes: &mut [u8]) -> io::Result<()> {
    getrandom::fill(bytes).map_err(|error| io::Error::other(error.to_string()))
}

/// Returns a big-endian number as `n` digits of base 62.
fn base62(bytes: &[u8], n: usize) -> String {
    let mut number = bytes.to_vec();
    let mut digits = vec![b'0'; n];
    for digit in digits.iter_mut().rev() {
        let mut rest = 0;
        for byte in &mut number {
            let value = rest * 256 + u32::from(*byte);
            *byte = (value / 62) as u8;
            rest = value % 62;
        }
        *digit = DIGITS[rest as usize];
    }
    digits.into_iter().map(char::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base62_writes_bytes_as_a_number() {
        assert_eq!(base62(&[0], 2), "00");
        assert_eq!(base62(&[61], 2), "0z");
        assert_eq!(base62(&[1, 0], 3), "048");
        let largest = base62(&[0xff; 32], SECRET_LETTERS);
        assert_eq!(largest, "yhjskwdA6OZ1AL1YmHWZWm8LLG7HjnuCA2j5rOw8Xp1");
    }

    #[test]
    fn only_written_tokens_are_parsed() {
        let (id, secret) = (random_id().unwrap(), Secret::random().unwrap());
        let token = token_text(&id, &secret.text);
        let read = Presented::parse(&token).unwrap();
        assert!(read.id == id && read.sha256 == secret.sha256);
        for other in [
            "",
            "frl",
            "frl_a_b",
            &token[1..],
            &token[..token.len() - 1],
            &format!("{token}0"),
            &token.replacen('_', "-", 1),
        ] {
            assert!(Presented::parse(other).is_none(), "{other}");
        }
    }

    #[test]
    fn hmac_matches_rfc_4231() {
        let hash = hmac_sha256(b"Jefe", b"what do ya want for nothing?");
        let hash: String = hash.iter().map(|byte| format!("{byte:02x}")).collect();
        let wanted = "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843";
        assert_eq!(hash, wanted);
    }

    #[test]
    fn comparison_finds_a_difference_in_any_byte() {
        let hash = hash("x");
        assert!(is_same(&hash, &hash));
        for index in 0..32 {
            let mut other = hash;
            other[index] ^= 1;
            assert!(!is_same(&other, &hash));
        }
        assert!(!is_same(&hash[..31], &hash) && !is_same(&[], &hash));
    }
}
