//! The binary container (glTF 2.0, section 4.4): header, JSON chunk, binary chunk.

/// The container's bytes; their number has to be within 32 bits.
#[must_use]
pub fn container(mut json: Vec<u8>, mut binary: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let mut out = Vec::with_capacity(length);
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&2_u32.to_le_bytes());
    out.extend_from_slice(&(length as u32).to_le_bytes());
    for (kind, chunk) in [(JSON, json), (BINARY, binary)] {
        out.extend_from_slice(&(chunk.len() as u32).to_le_bytes());
        out.extend_from_slice(kind);
        out.extend_from_slice(&chunk);
    }
    out
}

const MAGIC: &[u8; 4] = b"glTF";
const JSON: &[u8; 4] = b"JSON";
const BINARY: &[u8; 4] = b"BIN\0";

/// A file's JSON, and its binary chunk where it is a container that has one. Chunks of kinds that glTF does not know and
/// bytes behind the container's own end are passed over, as the standard has it; the `gltf` crate's reader refuses them.
///
/// # Errors
///
/// In words, if it is a container that is cut short, of another version, or does not begin with JSON.
pub(super) fn contents(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let Some(body) = bytes.strip_prefix(MAGIC) else { return Ok((bytes, None)) };
    let short = |what: &str| format!("its {what} is cut short");
    let (version, body) = word(body).ok_or_else(|| short("header"))?;
    let (length, _) = word(body).ok_or_else(|| short("header"))?;
    if version != 2 {
        return Err(format!("its container is of version {version}"));
    }
    if length < 12 {
        return Err(format!("its header promises {length} bytes, fewer than it has itself"));
    }
    let mut rest = bytes
        .get(..length as usize)
        .and_then(|own| own.get(12..))
        .ok_or_else(|| format!("its header promises {length} bytes, and it holds {}", bytes.len()))?;
    let (mut json, mut binary) = (None, None);
    while !rest.is_empty() {
        let header = word(rest).and_then(|(length, body)| Some((length, body.split_at_checked(4)?)));
        let Some((length, (kind, body))) = header else {
            // Padding behind the last chunk.
            if json.is_some() {
                break;
            }
            return Err(short("chunk's header"));
        };
        let (chunk, behind) = body.split_at_checked(length as usize).ok_or_else(|| short("chunk"))?;
        match (json, binary) {
            (None, _) if kind == JSON => json = Some(chunk),
            (None, _) => return Err("its first chunk is not of JSON".to_owned()),
            (Some(_), None) if kind == BINARY => binary = Some(chunk),
            _ => {}
        }
        rest = behind;
    }
    Ok((json.ok_or_else(|| short("first chunk"))?, binary))
}

/// The number that `bytes` begin with, and what is behind it.
fn word(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let (number, rest) = bytes.split_first_chunk()?;
    Some((u32::from_le_bytes(*number), rest))
}
