//! One pixel, as all panes have it.

use std::sync::Arc;

use crate::look::Pane;
use crate::paint::Slot;
use crate::render::image::Image;
use crate::session::Session;
use crate::shown;

/// What a pixel is, as rows of names and numbers; the residual and FLIP are of that image, where it is drawn, else of the
/// sliders'.
#[must_use]
pub fn rows(session: &Session, error_of: Slot, [x, y]: [u32; 2]) -> Vec<(String, String)> {
    let mut rows = vec![("pixel".to_owned(), format!("{x}, {y}"))];
    if let (Some(opened), Some(camera)) = (session.opened(), session.camera())
        && let Some(place) = opened.place(&camera, x, y)
    {
        let three = |v: [f32; 3]| format!("{:.4} {:.4} {:.4}", v[0], v[1], v[2]);
        rows.push(("position".to_owned(), three(place.position.to_array())));
        rows.push(("normal".to_owned(), three(place.normal.to_array())));
        if let Some([u, v]) = place.uv {
            rows.push(("uv".to_owned(), format!("{u:.5} {v:.5}")));
        }
    }
    let value = |image: &Arc<Image>| {
        let i = y as usize * image.width + x as usize;
        image.rgb.get(i).filter(|_| (x as usize) < image.width).copied()
    };
    let three = |rgb: [f32; 3]| format!("{:.5} {:.5} {:.5}", rgb[0], rgb[1], rgb[2]);
    for pane in [Pane::Target, Pane::Now, Pane::Start, Pane::Fit, Pane::Other] {
        if let Some(rgb) = shown::image(session, pane).as_ref().and_then(value) {
            rows.push((shown::name(pane).to_owned(), three(rgb)));
        }
    }
    let error_of = if session.image(error_of).is_some() { error_of } else { Slot::Now };
    let compared = shown::compared(session, error_of);
    if let Some([Some(image), Some(target)]) = compared.map(|pair| pair.each_ref().map(value)) {
        rows.push(("residual".to_owned(), three([0, 1, 2].map(|c| image[c] - target[c]))));
    }
    if let Some(map) = session.image(error_of).and_then(|painted| painted.compared.as_ref()) {
        rows.extend(value(&map.map).map(|flip| ("FLIP".to_owned(), format!("{:.4}", flip[0]))));
    }
    for term in shown::terms(session) {
        if let Some(rgb) = shown::image(session, Pane::Term(term)).as_ref().and_then(value) {
            rows.push((term.name().to_owned(), three(rgb)));
        }
    }
    rows
}
