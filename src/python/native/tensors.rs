//! The function of constants and maps on burn's tensors. They live on one thread, which does everything with them: burn
//! keeps memory of its own for each thread that computes.

use std::path::Path;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};

use pyo3::{PyErr, PyResult, Python};
use skinfit_core::engine::Point;
use skinfit_core::engine::view::ObservedView;
use skinfit_core::model::params::Param;
use skinfit_core::scene::MapKind;
use skinfit_gpu::Choice;
use skinfit_host::cli::tensor_words;
use skinfit_tensor::maps::function::acts_through_cubes;
use skinfit_tensor::maps::{MapError, MapFunction, MapGradients, MapTask};
use skinfit_tensor::{SharedDevice, TensorError};

use crate::errors::Refused;
use crate::free::Free;
use crate::maps::{GivenMaps, Gradients, Map};
use crate::waiting::{begin, guarded, locked, next, not_forked};

/// A function, shared with the thread.
pub(crate) struct Function {
    /// None where it is dropped.
    own: Option<Arc<MapFunction>>,
    adapter: String,
    free: Arc<Free>,
    maps: Vec<Map>,
}

/// The adapters that were opened, by the names that they were requested by.
#[derive(Default)]
struct Adapters(Vec<(Option<String>, SharedDevice)>);

/// What the thread is to do.
type Job = Box<dyn FnOnce(&mut Adapters) + Send>;

/// Where jobs are sent to, once there is a thread.
static THREAD: Mutex<Option<Sender<Job>>> = Mutex::new(None);

/// Tensors go where they live.
impl Drop for Function {
    fn drop(&mut self) {
        if let (Some(own), Ok(jobs)) = (self.own.take(), thread()) {
            let _ = jobs.send(Box::new(move |_| drop(own)));
        }
    }
}

impl Function {
    /// That none of these constants is one that cannot be free beside these maps of the scene in that file.
    pub(crate) fn check(
        scene: &Path,
        kinds: &[MapKind],
        mut free: impl Iterator<Item = Param>,
    ) -> Result<(), Refused> {
        match free.find(|&param| acts_through_cubes(param, kinds)) {
            Some(param) => Err(refused(&MapError::Sharpness { param: param.name() }, scene)),
            None => Ok(()),
        }
    }

    /// Of the views, on the adapter of that name.
    pub(crate) fn new(
        py: Python<'_>,
        free: &Arc<Free>,
        views: Arc<[ObservedView]>,
        kinds: Vec<MapKind>,
        adapter: Option<String>,
    ) -> PyResult<Self> {
        let of = Arc::clone(free);
        let own = there(py, move |adapters| {
            let shared = adapters.open(adapter)?;
            let posed = of.baked.scene.mesh.pose();
            let task = MapTask::new(&of.baked, &posed, views.to_vec(), kinds);
            MapFunction::new(&shared, task).map_err(|error| refused(&error, &of.baked.scene.path))
        })?;
        let map =
            |map: skinfit_tensor::maps::MapInfo| Map { name: map.name, shape: map.shape, bounds: map.bounds };
        let maps = own.maps().into_iter().map(map).collect();
        let adapter = own.adapter().to_owned();
        Ok(Self { own: Some(Arc::new(own)), adapter, free: Arc::clone(free), maps })
    }

    pub(crate) fn adapter(&self) -> &str {
        &self.adapter
    }

    pub(crate) fn maps(&self) -> &[Map] {
        &self.maps
    }

    /// The maps' numbers at the start.
    pub(crate) fn start(&self, py: Python<'_>) -> PyResult<Vec<Vec<f32>>> {
        self.evaluate(py, MapFunction::start)
    }

    /// The loss.
    pub(crate) fn loss(&self, py: Python<'_>, point: Point, maps: GivenMaps) -> PyResult<f64> {
        self.evaluate(py, move |own| own.loss(&point, maps))
    }

    /// The loss and its gradients.
    pub(crate) fn loss_and_gradient(
        &self,
        py: Python<'_>,
        point: Point,
        maps: GivenMaps,
    ) -> PyResult<(f64, Gradients)> {
        let (loss, found) = self.evaluate(py, move |own| own.loss_and_gradient(&point, maps))?;
        Ok((loss, gradients(found)))
    }

    /// A view's image.
    pub(crate) fn image(
        &self,
        py: Python<'_>,
        view: usize,
        point: Point,
        maps: GivenMaps,
    ) -> PyResult<Vec<f32>> {
        self.evaluate(py, move |own| own.image(view, &point, maps))
    }

    /// The gradients of the inner product of a view's image and another one.
    pub(crate) fn vjp(
        &self,
        py: Python<'_>,
        view: usize,
        point: Point,
        maps: GivenMaps,
        image: Vec<f32>,
    ) -> PyResult<Gradients> {
        Ok(gradients(self.evaluate(py, move |own| own.vjp(view, &point, maps, &image))?))
    }

    fn evaluate<T: Send + 'static>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&MapFunction) -> Result<T, MapError> + Send + 'static,
    ) -> PyResult<T> {
        let (own, free) = (self.own.clone(), Arc::clone(&self.free));
        there(py, move |_| {
            let gone = || Refused::Fault("a function was asked for after it was dropped".to_owned());
            work(own.as_deref().ok_or_else(gone)?).map_err(|error| refused(&error, &free.baked.scene.path))
        })
    }
}

fn gradients(found: MapGradients) -> Gradients {
    (found.constants, found.maps)
}

impl Adapters {
    /// The device of the adapter of that name; each is opened once, but for one that has failed.
    fn open(&mut self, name: Option<String>) -> Result<SharedDevice, Refused> {
        self.0.retain(|(_, shared)| shared.gpu().check().is_ok());
        if let Some((_, shared)) = self.0.iter().find(|(of, _)| *of == name) {
            return Ok(shared.clone());
        }
        let choice = Choice { name: name.clone(), ..Choice::default() };
        let shared = SharedDevice::open(&choice).map_err(|error| Refused::Device(tensor_words(&error)))?;
        self.0.push((name, shared.clone()));
        Ok(shared)
    }
}

/// Do some work on the thread of the tensors and wait for it. After Ctrl-C nobody waits for it any more; the next job
/// comes after it.
fn there<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&mut Adapters) -> Result<T, Refused> + Send + 'static,
) -> PyResult<T> {
    not_forked()?;
    let (send, receive) = channel();
    let job = move |adapters: &mut Adapters| {
        // Who waited may be gone.
        let _ = send.send(guarded(|| work(adapters)));
    };
    // Nobody to take it drops it, of which whoever waits hears.
    let _ = thread()?.send(Box::new(job));
    next(py, &Mutex::new(receive))?.flatten().map_err(PyErr::from)
}

fn thread() -> PyResult<Sender<Job>> {
    let mut thread = locked(&THREAD);
    if let Some(jobs) = &*thread {
        return Ok(jobs.clone());
    }
    let (jobs, receive) = channel::<Job>();
    let run = move || {
        let mut adapters = Adapters::default();
        receive.iter().for_each(|job| job(&mut adapters));
    };
    begin("skinfit tensors", run)?;
    *thread = Some(jobs.clone());
    Ok(jobs)
}

/// What is raised for an error about the scene in that file.
fn refused(error: &MapError, scene: &Path) -> Refused {
    let words = match error {
        MapError::Tensor(error) => tensor_words(error),
        error => error.to_string(),
    };
    let words = format!("{}: {}.", scene.display(), words.trim_end_matches('.'));
    match error {
        MapError::Tensor(TensorError::Model(_) | TensorError::Levels { .. })
        | MapError::Shading(_)
        | MapError::Beside { .. }
        | MapError::InTexels { .. }
        | MapError::Filtered { .. }
        | MapError::LaidOut { .. }
        | MapError::Unread { .. }
        | MapError::NotUnwrapped { .. } => Refused::Scene(words),
        MapError::Tensor(_) | MapError::TooLarge { .. } | MapError::OutOfMemory { .. } => {
            Refused::Device(words)
        }
        MapError::Sharpness { .. } => Refused::Param(words),
        MapError::Length { .. } => Refused::Array(words),
        MapError::NoView { .. } => Refused::View(words),
        MapError::Constants(_) | MapError::NotFinite { .. } => Refused::Fit(words),
    }
}
