//! Images: which are requested, which are shown, and what an effect changed in them.

use std::sync::Arc;

use super::Session;
use crate::engine::Point;
use crate::model::effects::Effect;
use crate::opened::Reading;
use crate::paint::{Answer, Job, Painted, Slot};
use crate::scene::view::Camera;
use crate::values::Values;

/// What an effect brought when it was turned on, or took when it was turned off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Change {
    /// Seconds a frame.
    pub seconds: f64,
    /// Bytes on the adapter.
    pub bytes: i64,
    /// dB of the view that is shown, where it has a target.
    pub psnr: Option<f64>,
}

impl Change {
    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        let Self { seconds, bytes, psnr } = self;
        let psnr = psnr.map_or_else(String::new, |psnr| format!(", {psnr:+.2} dB"));
        format!("{:+.1} ms, {:+.2} MB{psnr}", 1e3 * seconds, *bytes as f64 / 1e6)
    }
}

/// What was known of the image before an effect was switched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Before {
    effect: Effect,
    scene: usize,
    camera: Camera,
    seconds: f64,
    uploaded: u64,
    psnr: Option<f64>,
}

impl Session {
    /// Ask for every image that is not the one that would be drawn now.
    pub(super) fn ask(&mut self) {
        let (Some(opened), Some(history), Some(camera)) = (self.opened(), &self.values, self.camera()) else {
            return;
        };
        if !history.now().is_read(self.scenes.iter().map(|opened| &**opened)) {
            if self.opening.is_none() {
                let scenes = self.start.scenes.iter().zip(history.now().scenes());
                let scenes = scenes.map(|(reading, values)| Reading {
                    effects: Some(values.effects),
                    params: None,
                    ..reading.clone()
                });
                self.read(scenes.collect());
            }
            return;
        }
        let point = |slot: Slot| match slot {
            Slot::Now => self.values().map(Values::point),
            Slot::Start => self.first().map(Values::point),
            Slot::Fit => self.here(self.fitted.as_deref()).cloned(),
            Slot::Other => self.here(self.other.as_deref()).cloned(),
        };
        let target = opened.targets.get(self.at.1).cloned().flatten().filter(|_| self.is_at_home());
        let job = |slot: Slot, Point { params, gains }: Point| Job {
            opened: Arc::clone(opened),
            params,
            gain: gains.get(self.at.1).copied().unwrap_or_default(),
            camera,
            target: target.clone(),
            terms: self.terms && slot == Slot::Now,
        };
        let wanted = Slot::ALL.into_iter().filter(|slot| self.looked_at.contains(slot));
        let jobs = wanted.filter_map(|slot| Some((slot, job(slot, point(slot)?))));
        for (slot, job) in jobs.collect::<Vec<_>>() {
            if self.asked.get(&slot).is_none_or(|asked| !same(asked, &job)) {
                let job = Arc::new(job);
                self.asked.insert(slot, Arc::clone(&job));
                self.painter.ask(slot, job);
            }
        }
    }

    /// Say which images somebody looks at beside that of the sliders, whose scores are always told: no others are drawn.
    pub fn look_for(&mut self, slots: impl IntoIterator<Item = Slot>) {
        self.looked_at = std::iter::once(Slot::Now).chain(slots).collect();
        let looked_at = &self.looked_at;
        self.asked.retain(|slot, _| looked_at.contains(slot));
        self.images.retain(|slot, _| looked_at.contains(slot));
    }

    /// Take in what the worker has said.
    pub(super) fn painted(&mut self, answer: Answer) {
        match answer {
            Answer::Painted(slot, mut painted) => {
                if !self.is_asked(slot, &painted) {
                    return;
                }
                if let Some(before) =
                    self.images.remove(&slot).filter(|before| before.job.camera == painted.job.camera)
                {
                    // Until its own are there, those of the image before are shown.
                    (painted.terms, painted.compared) = (before.terms, before.compared);
                }
                self.images.insert(slot, painted);
            }
            Answer::Whole(slot, painted) => {
                if !self.is_asked(slot, &painted) {
                    return;
                }
                self.images.insert(slot, painted);
                if slot == Slot::Now {
                    self.weigh();
                }
            }
            Answer::Failed(slot, words) => {
                self.images.remove(&slot);
                self.told.push(words);
            }
            Answer::Engine(name) => self.engine = name,
            Answer::Told(words) => self.told.push(words),
        }
    }

    /// Whether an image is of the scene and the camera that are shown now.
    fn is_asked(&self, slot: Slot, painted: &Painted) -> bool {
        self.asked.get(&slot).is_some_and(|asked| {
            asked.camera == painted.job.camera && Arc::ptr_eq(&asked.opened, &painted.job.opened)
        })
    }

    /// What the effect that was switched has changed, once its image is there.
    fn weigh(&mut self) {
        let drawn = self.images.get(&Slot::Now).map(|now| now.job.opened.baked.scene.effects);
        let wanted = self.values().map(|values| values.effects);
        if drawn != wanted {
            return;
        }
        // Of another scene or camera nothing can be told.
        let here = (self.scene(), self.camera());
        let before = self.switched.take().filter(|before| (before.scene, Some(before.camera)) == here);
        if let (Some(before), Some(now)) = (before, self.images.get(&Slot::Now)) {
            let psnr = now.compared.as_ref().map(|compared| compared.psnr);
            let change = Change {
                seconds: now.seconds - before.seconds,
                bytes: now.uploaded as i64 - before.uploaded as i64,
                psnr: psnr.zip(before.psnr).map(|(now, before)| now - before),
            };
            self.changes.insert((before.scene, before.effect.name()), change);
        }
    }

    /// Note what is known of the image before an effect is switched.
    pub(super) fn weigh_from(&mut self, effect: Effect) {
        // What two have changed together is neither's.
        let alone = self.switched.is_none() && !self.is_opening();
        self.switched = self.image(Slot::Now).filter(|_| alone).map(|now| Before {
            effect,
            scene: self.scene(),
            camera: now.job.camera,
            seconds: now.seconds,
            uploaded: now.uploaded,
            psnr: now.compared.as_ref().map(|compared| compared.psnr),
        });
    }
}

/// Whether two jobs draw the same.
fn same(a: &Job, b: &Job) -> bool {
    let target = match (&a.target, &b.target) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (a, b) => a.is_none() && b.is_none(),
    };
    Arc::ptr_eq(&a.opened, &b.opened)
        && (a.gain, a.camera, a.terms) == (b.gain, b.camera, b.terms)
        && target
        && a.params == b.params
}
