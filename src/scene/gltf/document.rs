//! A glTF file: its JSON, its buffers, and lookups by index that refuse what is out of range.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use base64::Engine;
use gltf::json;
use json::Index;
use percent_encoding::percent_decode_str;

use super::{container, parse};
use crate::error::{SceneError, guarded, read_bytes};

/// No mesh file or buffer above this many bytes is read.
pub(super) const MOST_BYTES: u64 = 1 << 32;

/// A parsed glTF file and the bytes that it refers to.
pub(crate) struct Document {
    pub(super) path: PathBuf,
    pub(super) root: json::Root,
    pub(super) buffers: Vec<Vec<u8>>,
    /// The animation that moves nodes, where there is one at this place.
    pub(super) clip: usize,
}

impl Document {
    /// Read and parse a .glb or .gltf file with all of its buffers; images are not read.
    pub(crate) fn open(path: &Path) -> Result<Self, SceneError> {
        let bytes = read_bytes(path, MOST_BYTES)?;
        let refused = |reason: String| {
            SceneError::new(
                path,
                format!("cannot be read as glTF 2.0: {}", reason.replace('\n', " ")),
                "The file is cut short, damaged or of another kind: export it anew as .glb",
            )
        };
        let (text, blob) = container::contents(&bytes).map_err(refused)?;
        let root = guarded(path, || parse::root(text).map_err(|e| refused(e.to_string())))?;
        let mut document = Self { path: path.to_owned(), root, buffers: Vec::new(), clip: 0 };
        document.check_extensions()?;
        document.load_buffers(blob.map(<[u8]>::to_vec))?;
        Ok(document)
    }

    fn load_buffers(&mut self, mut blob: Option<Vec<u8>>) -> Result<(), SceneError> {
        for (i, buffer) in self.root.buffers.iter().enumerate() {
            let bytes = match &buffer.uri {
                None => blob.take().filter(|_| i == 0).ok_or_else(|| {
                    self.error("has no binary chunk for its buffer", "Export it anew")
                        .at(format!("buffer {i}"))
                })?,
                Some(uri) => self.resolve(uri, &format!("buffer {i}"))?,
            };
            let (held, promised) = (bytes.len() as u64, buffer.byte_length.0);
            if held < promised {
                return Err(self
                    .error(format!("holds {held} bytes of {promised}: it is cut short"), "Export it anew")
                    .at(format!("buffer {i}")));
            }
            self.buffers.push(bytes);
        }
        Ok(())
    }

    /// The bytes behind a URI: a data URI, or a file beside this one.
    pub(super) fn resolve(&self, uri: &str, place: &str) -> Result<Vec<u8>, SceneError> {
        let at = |error: SceneError| error.at(place);
        if let Some(data) = uri.strip_prefix("data:") {
            let Some((head, body)) = data.split_once(',') else {
                return Err(at(
                    self.error("has a data URI without a comma before its data", "Export it anew")
                ));
            };
            let body: Cow<'_, [u8]> = percent_decode_str(body).into();
            let encoding = head.rsplit_once(';').map_or("", |(_, encoding)| encoding.trim());
            if !encoding.eq_ignore_ascii_case("base64") {
                return Ok(body.into_owned());
            }
            let engine = &base64::engine::GeneralPurpose::new(
                &base64::alphabet::STANDARD,
                base64::engine::GeneralPurposeConfig::new()
                    .with_decode_padding_mode(base64::engine::DecodePaddingMode::Indifferent),
            );
            return engine
                .decode(body.trim_ascii())
                .map_err(|e| at(self.error(format!("has a damaged data URI: {e}"), "Export it anew")));
        }
        if uri.contains("://") {
            return Err(at(self.error(format!("is at {uri}, which is not fetched"), "Export it as .glb")));
        }
        let decoded = percent_decode_str(uri).decode_utf8_lossy();
        let folder = self.path.parent().unwrap_or(Path::new(""));
        read_bytes(&folder.join(decoded.as_ref()), MOST_BYTES)
    }

    /// The file, for messages.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the file moves any node.
    pub(crate) fn animated(&self) -> bool {
        !self.root.animations.is_empty()
    }

    /// An error about this file.
    pub(super) fn error(&self, what: impl Into<String>, remedy: &str) -> SceneError {
        SceneError::new(&self.path, what, remedy)
    }

    /// What `index` names in `list`.
    pub(super) fn get<'a, T>(&self, list: &'a [T], index: Index<T>, kind: &str) -> Result<&'a T, SceneError> {
        list.get(index.value()).ok_or_else(|| {
            self.error(
                format!("refers to {kind} {}, but has {}", index.value(), list.len()),
                "The file is damaged: export it anew",
            )
        })
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, index: Index<json::buffer::View>) -> Result<&[u8], SceneError> {
        let view = self.get(&self.root.buffer_views, index, "buffer view")?;
        let buffer: &Vec<u8> = self
            .buffers
            .get(view.buffer.value())
            .ok_or_else(|| self.outside("buffer view", index.value()))?;
        let start = view.byte_offset.map_or(0, |offset| offset.0);
        let end = start.checked_add(view.byte_length.0);
        end.and_then(|end| buffer.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?))
            .ok_or_else(|| self.outside("buffer view", index.value()))
    }

    /// An error: something reaches beyond the bytes that hold it.
    pub(super) fn outside(&self, kind: &str, index: usize) -> SceneError {
        self.error(
            "reaches beyond the bytes that are there",
            "The file is damaged or cut short: export it anew",
        )
        .at(format!("{kind} {index}"))
    }
}
