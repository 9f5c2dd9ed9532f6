//! One computation on a Rust thread, which Python watches, cancels and collects.
//!
//! Python threads must not outlive a script in Blender, so the worker is a Rust thread that never
//! enters Python: it gets owned data and leaves a [`Delivery`], which becomes a Python object when
//! a Python thread asks for it.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use ble_unwrap_core::{Progress, Stage};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::allocator;
use crate::errors::{Failure, InvalidArgumentError};

/// Turns the output of a computation into a Python object, once, with the interpreter held.
type Delivery = Box<dyn FnOnce(Python<'_>) -> PyResult<Py<PyAny>> + Send>;

/// Stack of a worker. Only address space until it is used; the dense eigensolver recurses.
const STACK_BYTES: usize = 16 << 20;

/// How often a waiting thread looks whether Ctrl-C was pressed.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// Progress, cancelling and outcome of one computation.
///
/// ``submit_unwrap`` returns a running job. A job made here waits to be given to one call by its
/// ``job`` keyword, so that another thread can watch that call or stop it. A job serves one call.
///
/// All methods return at once, except ``wait`` and ``result``, and may be called from any thread.
/// The computation runs on Rust threads and calls nothing in Python. A running job that is garbage
/// collected is cancelled, for nobody could collect its result.
#[pyclass(frozen, module = "ble_unwrap_native")]
pub(crate) struct Job {
    shared: Arc<Shared>,
}

struct Shared {
    progress: Progress,
    state: Mutex<State>,
    finished: Condvar,
}

enum State {
    /// Not given to a call yet.
    Idle,
    Running,
    /// Done; nobody has asked for the result yet.
    Ready(Delivery),
    /// A Python thread is making the object.
    Delivering,
    Delivered(Py<PyAny>),
    Failed(Failure),
}

impl Shared {
    /// No code panics while it holds the lock, and if it did the state would still be whole.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether the worker runs and may still bring a result. Once it is stopping it only frees its memory: that there is
    /// none is told at once.
    fn is_running(&self, state: &State) -> bool {
        matches!(state, State::Running) && !self.progress.is_stopping()
    }

    fn is_finished(&self) -> bool {
        let state = self.lock();
        !matches!(*state, State::Idle) && !self.is_running(&state)
    }

    /// Whether the result is still to come: by the worker or by a thread that makes the object.
    fn is_pending(&self) -> bool {
        let state = self.lock();
        matches!(*state, State::Delivering) || self.is_running(&state)
    }

    /// Waits while the result is pending, for `limit` at most. Never call it with the interpreter held.
    fn wait(&self, limit: Duration) {
        let pending = |state: &mut State| matches!(state, State::Delivering) || self.is_running(state);
        drop(self.finished.wait_timeout_while(self.lock(), limit, pending));
    }
}

impl Job {
    /// The job of a call: the one its caller gave, or a new one.
    pub(crate) fn given_or_new<'py>(py: Python<'py>, given: Option<Bound<'py, Self>>) -> PyResult<Bound<'py, Self>> {
        given.map_or_else(|| Bound::new(py, Self::new()), Ok)
    }

    /// Runs `work` on a thread of its own; `deliver` makes the Python object of its output.
    ///
    /// `threads` limits the parallelism of the work, 0 leaves it to the machine. A panic in `work`
    /// becomes a [`Failure`]. A job that was cancelled before does not start to work.
    ///
    /// # Errors
    /// `InvalidArgumentError` if the job has served a call already.
    pub(crate) fn start<T: Send + 'static>(
        &self,
        threads: usize,
        work: impl FnOnce(&Progress) -> Result<T, Failure> + Send + 'static,
        deliver: impl FnOnce(Python<'_>, T) -> PyResult<Py<PyAny>> + Send + 'static,
    ) -> PyResult<()> {
        {
            let mut state = self.shared.lock();
            if !matches!(*state, State::Idle) {
                return Err(InvalidArgumentError::new_err("job: expected a new Job, found one that has served a call"));
            }
            *state = State::Running;
        }
        let shared = Arc::clone(&self.shared);
        let run = move || {
            shared.progress.begin();
            let outcome = catch_unwind(AssertUnwindSafe(|| {
                shared.progress.check().map_err(Failure::from)?;
                with_threads(threads, || {
                    // After the threads: they cannot be had from the reserve.
                    allocator::hold_reserve();
                    work(&shared.progress)
                })
            }));
            let outcome = outcome.unwrap_or_else(|panic| Err(Failure::panic(&panic_text(&*panic))));
            // Which may have been told already.
            let outcome = if shared.progress.is_stopping() { Err(Failure::cancelled()) } else { outcome };
            if outcome.is_ok() {
                shared.progress.enter(Stage::Done);
            }
            *shared.lock() = match outcome {
                Ok(output) => State::Ready(Box::new(move |py| deliver(py, output))),
                Err(failure) => State::Failed(failure),
            };
            shared.finished.notify_all();
        };
        let spawned = std::thread::Builder::new().name("ble_unwrap".into()).stack_size(STACK_BYTES).spawn(run);
        if let Err(error) = spawned {
            *self.shared.lock() = State::Failed(Failure::threads(&error));
        }
        Ok(())
    }

    /// Waits with the interpreter released until the work is done, then hands over the result.
    /// Ctrl-C cancels the work, waits for it to stop and raises `KeyboardInterrupt`.
    pub(crate) fn finish(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        while self.shared.is_pending() {
            py.detach(|| self.shared.wait(SIGNAL_INTERVAL));
            if let Err(interrupt) = py.check_signals() {
                self.shared.progress.cancel();
                while self.shared.is_pending() {
                    py.detach(|| self.shared.wait(SIGNAL_INTERVAL));
                }
                return Err(interrupt);
            }
        }
        self.deliver(py)
    }

    /// The result of finished work. The same object every time.
    fn deliver(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let mut state = self.shared.lock();
        match &*state {
            State::Failed(failure) => return Err(failure.to_py_err()),
            State::Delivered(object) => return Ok(object.clone_ref(py)),
            State::Idle => return Err(InvalidArgumentError::new_err("the job was never given to a call")),
            State::Running if self.shared.progress.is_stopping() => return Err(Failure::cancelled().to_py_err()),
            State::Running | State::Delivering | State::Ready(_) => {}
        }
        // While the object is made the interpreter may switch threads: others must find the lock
        // free, see `Delivering` and wait for the signal.
        let delivery = match std::mem::replace(&mut *state, State::Delivering) {
            State::Ready(delivery) => delivery,
            pending => {
                *state = pending;
                drop(state);
                return self.finish(py);
            }
        };
        drop(state);
        let (next, outcome) = match delivery(py) {
            Ok(object) => (State::Delivered(object.clone_ref(py)), Ok(object)),
            Err(error) => (State::Failed(Failure::delivery(&error)), Err(error)),
        };
        *self.shared.lock() = next;
        self.shared.finished.notify_all();
        outcome
    }
}

#[pymethods]
impl Job {
    #[new]
    fn new() -> Self {
        let shared = Shared { progress: Progress::new(), state: Mutex::new(State::Idle), finished: Condvar::new() };
        Self { shared: Arc::new(shared) }
    }

    /// Share of the work done, from 0 to 1. Never falls; 1 once the work has succeeded.
    fn progress(&self) -> f64 {
        self.shared.progress.fraction()
    }

    /// What the computation is doing, in a word or two for a status line.
    fn stage(&self) -> &'static str {
        self.shared.progress.stage().name()
    }

    /// Asks the computation to stop, which it does within about a tenth of a second.
    ///
    /// The job then ends with ``Cancelled``, unless it was finished already: a finished job keeps
    /// its result. May be called before the job is given to a call, which then does nothing.
    fn cancel(&self) {
        self.shared.progress.cancel();
    }

    /// Whether ``cancel`` has been called, also when that was too late to matter.
    fn is_cancelled(&self) -> bool {
        self.shared.progress.is_cancelled()
    }

    /// Whether the computation has ended, be it with a result, an error or ``Cancelled``.
    fn is_finished(&self) -> bool {
        self.shared.is_finished()
    }

    /// Wait until the computation has ended.
    ///
    /// Other Python threads run meanwhile, and Ctrl-C raises ``KeyboardInterrupt`` (the computation
    /// goes on).
    ///
    /// Parameters
    /// ----------
    /// timeout : float, optional
    ///     Longest wait in seconds; without it, as long as it takes.
    ///
    /// Returns
    /// -------
    /// bool
    ///     Whether the computation has ended. A job not given to a call yet returns ``False`` at once.
    ///
    /// Raises
    /// ------
    /// InvalidArgumentError
    ///     If ``timeout`` is negative or not a number.
    #[pyo3(signature = (timeout=None))]
    fn wait(&self, py: Python<'_>, timeout: Option<f64>) -> PyResult<bool> {
        if timeout.is_some_and(|t| t.is_nan() || t < 0.0) {
            let found = timeout.unwrap_or_default();
            return Err(InvalidArgumentError::new_err(format!(
                "timeout: expected seconds, 0 or more, or None; found {found}"
            )));
        }
        // Too long for the clock is as good as for ever.
        let deadline = timeout
            .and_then(|t| Duration::try_from_secs_f64(t).ok())
            .and_then(|limit| Instant::now().checked_add(limit));
        loop {
            let left = deadline.map_or(SIGNAL_INTERVAL, |d| d.saturating_duration_since(Instant::now()));
            if left.is_zero() || !self.shared.is_running(&self.shared.lock()) {
                return Ok(self.shared.is_finished());
            }
            py.detach(|| self.shared.wait(left.min(SIGNAL_INTERVAL)));
            py.check_signals()?;
        }
    }

    /// The result: waits for it, then returns what the call would have returned.
    ///
    /// For ``submit_unwrap`` an ``Atlas``; the same object every time. Ctrl-C cancels the
    /// computation and raises ``KeyboardInterrupt``.
    ///
    /// Raises
    /// ------
    /// Cancelled
    ///     If the job was cancelled before it was finished.
    /// BleUnwrapError
    ///     Whatever the call would have raised.
    /// InvalidArgumentError
    ///     If the job was never given to a call.
    fn result(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.finish(py)
    }

    fn __repr__(&self) -> String {
        let state = match *self.shared.lock() {
            State::Idle => "not started",
            State::Running if self.shared.progress.is_stopping() => "failed",
            State::Running => "running",
            State::Ready(_) | State::Delivering | State::Delivered(_) => "finished",
            State::Failed(_) => "failed",
        };
        format!("Job({state}, {:.0} %, {})", 100.0 * self.progress(), self.stage())
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        self.shared.progress.cancel();
    }
}

/// Whether this process was forked from one that had used the shared threads, which a fork does not bring along.
fn forked() -> bool {
    static OWNER: OnceLock<u32> = OnceLock::new();
    let here = std::process::id();
    *OWNER.get_or_init(|| here) != here
}

/// Runs `work` with at most `threads` threads of its own, or on the shared ones if that is 0.
fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> Result<T, Failure> + Send) -> Result<T, Failure> {
    if threads == 0 && !forked() { shared_pool()?.install(work) } else { pool(threads)?.install(work) }
}

/// As many threads as the machine has, made at the first call. Rayon's own are not used: where they cannot be started it
/// panics at every later call, too.
fn shared_pool() -> Result<Arc<ThreadPool>, Failure> {
    static SHARED: Mutex<Option<Arc<ThreadPool>>> = Mutex::new(None);
    let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(pool) = &*shared {
        return Ok(Arc::clone(pool));
    }
    let pool = Arc::new(pool(0)?);
    *shared = Some(Arc::clone(&pool));
    Ok(pool)
}

fn pool(threads: usize) -> Result<ThreadPool, Failure> {
    let builder = ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("ble_unwrap_{i}"));
    builder.build().map_err(|error| Failure::threads(&error))
}

fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".into())
}
