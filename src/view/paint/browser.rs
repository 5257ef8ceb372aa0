//! The worker between the events of a browser's worker, where nothing may wait.

use std::future::poll_fn;
use std::pin::pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Poll, Waker};

use js_sys::{Function, Promise, Reflect, global};
use wasm_bindgen::{JsCast as _, JsValue};
use wasm_bindgen_futures::{JsFuture, spawn_local};

use super::work::{Piece, Work};
use super::{QUIET, Shared};

/// Who waits for a request.
#[derive(Default)]
pub(super) struct Changed(Mutex<Option<Waker>>);

impl Changed {
    pub(super) fn tell(&self) {
        let waker = self.0.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(waker) = waker {
            waker.wake();
        }
    }

    fn listen(&self, waker: &Waker) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(waker.clone());
    }
}

/// The task, which ends by itself once it is over.
pub(super) struct Task;

impl Task {
    /// Do the `work` until it is over.
    pub(super) fn begin(shared: Arc<Shared>, work: impl FnOnce() -> Work + 'static) -> Self {
        spawn_local(async move {
            let mut work = work();
            while let Some(piece) = next(&shared).await {
                work.step(piece, &shared).await;
                // The CPU engine has not waited for anything: what was asked in the meantime is heard.
                timeout(0).await;
            }
        });
        Self
    }

    #[expect(clippy::unused_self, reason = "as of a thread")]
    pub(super) const fn is_over(&self) -> bool {
        false
    }

    #[expect(clippy::unused_self, reason = "as of a thread")]
    pub(super) const fn end(&mut self) {}
}

/// Wait for something to do; `None` when it is over.
async fn next(shared: &Shared) -> Option<Piece> {
    loop {
        let changed = poll_fn(|context| {
            let mut wanted = shared.wanted();
            if wanted.over {
                return Poll::Ready(None);
            }
            if let Some(piece) = wanted.next(false) {
                return Poll::Ready(Some(Some(piece)));
            }
            if !wanted.follow.is_empty() {
                return Poll::Ready(Some(None));
            }
            shared.changed.listen(context.waker());
            Poll::Pending
        });
        if let Some(piece) = changed.await? {
            return Some(piece);
        }
        quiet(shared).await;
        if let Some(piece) = shared.wanted().next(true) {
            return Some(piece);
        }
    }
}

/// Wait for a while, or until a request comes.
async fn quiet(shared: &Shared) {
    let mut timer = pin!(timeout(QUIET));
    poll_fn(|context| {
        let wanted = shared.wanted();
        if wanted.over || !wanted.jobs.is_empty() {
            return Poll::Ready(());
        }
        drop(wanted);
        shared.changed.listen(context.waker());
        timer.as_mut().poll(context)
    })
    .await;
}

/// Let the browser do other things for `milliseconds`.
async fn timeout(milliseconds: u32) {
    let timer = Promise::new(&mut |resolve, _| {
        let timeout = Reflect::get(&global(), &"setTimeout".into());
        if let Some(timeout) = timeout.ok().and_then(|timeout| timeout.dyn_into::<Function>().ok()) {
            // Without a timer nothing would follow: a browser has one.
            let _ = timeout.call2(&JsValue::UNDEFINED, &resolve, &milliseconds.into());
        }
    });
    // A timer does not fail.
    let _ = JsFuture::from(timer).await;
}
