//! The XML of `FileStorage`: elements below the root are entries, those below them their parts.

use std::path::Path;

use roxmltree::{Document, Node};

use super::super::damaged;
use super::entries::Entries;
use crate::error::SceneError;

pub(super) fn entries<'a>(path: &'a Path, text: &str) -> Result<Entries<'a>, SceneError> {
    let document = Document::parse(text).map_err(|error| {
        damaged(path, format!("line {}", error.pos().row), format!("is no XML of OpenCV: {error}"))
    })?;
    if !document.root_element().has_tag_name("opencv_storage") {
        return Err(damaged(path, "its root", "is not opencv_storage, so it is no XML of OpenCV"));
    }
    let mut entries = Entries::new(path);
    let elements =
        |node: Node<'_, '_>| node.children().filter(Node::is_element).map(|child| child.id()).collect();
    let node = |id| document.get_node(id);
    let top: Vec<_> = elements(document.root_element());
    for entry in top.into_iter().filter_map(node) {
        let name = entry.tag_name().name();
        let line = |node: Node<'_, '_>| document.text_pos_at(node.range().start).row as usize;
        let parts: Vec<_> = elements(entry);
        if parts.is_empty() {
            entries.keep(name.to_owned(), line(entry), entry.text().unwrap_or_default());
        }
        for part in parts.into_iter().filter_map(node) {
            let name = format!("{name}.{}", part.tag_name().name());
            entries.keep(name, line(part), part.text().unwrap_or_default());
        }
    }
    Ok(entries)
}
