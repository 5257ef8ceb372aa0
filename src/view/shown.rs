//! What panes show: which images, under which names, and what stands above them.

use std::sync::Arc;

use crate::look::{ErrorKind, Layout, Look, Pane};
use crate::model::terms::TermName;
use crate::paint::{Painted, Slot};
use crate::render::image::Image;
use crate::session::Session;

/// What a pane makes of its images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// The first image.
    Image,
    /// The first less the second, or FLIP's map, which is the first.
    Error(ErrorKind),
    /// The first to the left of a line, the second to its right.
    Wipe(f32),
}

/// What the end of each error's scale stands for: FLIP's own, linear radiance, a share of the target.
#[must_use]
pub const fn scale(kind: ErrorKind) -> f32 {
    match kind {
        ErrorKind::Flip => 1.0,
        ErrorKind::Signed => 0.1,
        ErrorKind::Relative => 0.5,
    }
}

/// A pane's name.
#[must_use]
pub fn name(pane: Pane) -> &'static str {
    match pane {
        Pane::Target => "target",
        Pane::Now => "now",
        Pane::Start => "start",
        Pane::Fit => "fit",
        Pane::Other => "other run",
        Pane::Error => "error",
        Pane::Term(term) => term.name(),
    }
}

/// What a pane says that has nothing to show.
#[must_use]
pub fn lacking(session: &Session, pane: Pane) -> &'static str {
    match pane {
        Pane::Target => "this view has no target",
        Pane::Fit if session.fitted().is_none() => "no fit yet",
        Pane::Other if session.other().is_none() => "no run is compared",
        Pane::Error => "nothing is compared",
        _ => "being drawn",
    }
}

/// The name of the pane that shows a slot's image.
#[must_use]
pub fn name_of(slot: Slot) -> &'static str {
    name(match slot {
        Slot::Now => Pane::Now,
        Slot::Fit => Pane::Fit,
        Slot::Start => Pane::Start,
        Slot::Other => Pane::Other,
    })
}

/// The slots whose images are shown.
pub fn slots(session: &Session, look: &Look) -> Vec<Slot> {
    let of = error_of(session, look);
    look.panes.iter().map(|pane| if *pane == Pane::Error { of } else { slot(*pane) }).collect()
}

/// The image whose error is shown: the one that was chosen, as long as there is one.
#[must_use]
pub fn error_of(session: &Session, look: &Look) -> Slot {
    if session.has(look.error_of) { look.error_of } else { Slot::Now }
}

/// The next image whose error can be shown.
#[must_use]
pub fn next_error_of(session: &Session, look: &Look) -> Slot {
    let slots: Vec<Slot> = errors_of(session).collect();
    let at = slots.iter().position(|slot| *slot == error_of(session, look)).unwrap_or(0);
    slots[(at + 1) % slots.len()]
}

/// The images whose errors can be shown.
pub fn errors_of(session: &Session) -> impl Iterator<Item = Slot> {
    Slot::ALL.into_iter().filter(|slot| session.has(*slot))
}

/// The slot whose image a pane shows.
const fn slot(pane: Pane) -> Slot {
    match pane {
        Pane::Start => Slot::Start,
        Pane::Fit => Slot::Fit,
        Pane::Other => Slot::Other,
        _ => Slot::Now,
    }
}

/// A pane's image, where there is one; none of the error's, which is made of two.
#[must_use]
pub fn image(session: &Session, pane: Pane) -> Option<Arc<Image>> {
    match pane {
        Pane::Target => session.opened()?.targets.get(session.view_number())?.clone(),
        Pane::Term(wanted) => {
            let terms = &session.image(Slot::Now)?.terms;
            terms.iter().find(|(term, _)| *term == wanted).map(|(_, image)| Arc::clone(image))
        }
        Pane::Error => None,
        pane => session.image(slot(pane)).map(|painted| Arc::clone(&painted.image)),
    }
}

/// An image and the target that it may be compared with: from a view's own camera.
#[must_use]
pub fn compared(session: &Session, slot: Slot) -> Option<[Arc<Image>; 2]> {
    let painted = session.image(slot)?;
    Some([Arc::clone(&painted.image), painted.job.target.clone()?])
}

/// The terms that there are images of.
#[must_use]
pub fn terms(session: &Session) -> Vec<TermName> {
    session.image(Slot::Now).map_or_else(Vec::new, |now| now.terms.iter().map(|(term, _)| *term).collect())
}

/// The images of a pane by itself, as its [`Kind`] takes them.
#[must_use]
pub fn pair(session: &Session, pane: Pane, look: &Look) -> Option<[Arc<Image>; 2]> {
    match (pane, look.error) {
        (Pane::Error, ErrorKind::Flip) => {
            let compared = session.image(error_of(session, look))?.compared.as_ref()?;
            Some([Arc::clone(&compared.map), Arc::clone(&compared.map)])
        }
        (Pane::Error, _) => compared(session, error_of(session, look)),
        (pane, _) => image(session, pane).map(|image| [Arc::clone(&image), image]),
    }
}

/// What stands above a pane: its name with its score, and the legend of its colours.
#[must_use]
pub fn title(session: &Session, look: &Look, pane: Pane) -> String {
    let scored = |painted: Option<&Painted>| {
        let compared = painted.and_then(|painted| painted.compared.as_ref());
        compared.map_or_else(String::new, |c| format!("  {:.2} dB, FLIP {:.4}", c.psnr, c.flip))
    };
    let colours = if look.false_colour { "  luminance, 2^-8 to 2^2" } else { "" };
    match (pane, look.layout) {
        (Pane::Error, _) => {
            let slot = error_of(session, look);
            let (scale, of) = (scale(look.error), name_of(slot));
            match look.error {
                ErrorKind::Flip if slot == Slot::Now => format!("error: FLIP, 0 to {scale}"),
                ErrorKind::Flip => format!("error of {of}: FLIP, 0 to {scale}"),
                ErrorKind::Signed => format!("error: {of} - target, blue -{scale} to red {scale}"),
                ErrorKind::Relative => format!("error: |{of} - target| / target, 0 to {scale}"),
            }
        }
        (pane, Layout::Wipe) => {
            let beside = look.panes.get(1).copied().unwrap_or(Pane::Now);
            format!("{} | {}{colours}", name(pane), name(beside))
        }
        (pane @ (Pane::Target | Pane::Term(_)), _) => format!("{}{colours}", name(pane)),
        (pane, _) => format!("{}{}{colours}", name(pane), scored(session.image(slot(pane)))),
    }
}
