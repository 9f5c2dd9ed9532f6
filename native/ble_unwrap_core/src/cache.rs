//! What was computed before for the same input, for an [`Analysis`](crate::Analysis) that is unwrapped again.
//!
//! A result is found by what it is a function of: its kind and a fingerprint of all that enters. So nothing that is kept
//! can be wrong for a later call, whatever its settings, and it does not matter which call kept it or whether another has
//! thrown it away: results are the same bit for bit with a cache and without.

use std::any::Any;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Point2;

use crate::geodesics::LandmarkDistances;
use crate::mesh::{TriMesh, VertexId};
use crate::progress::Progress;

/// Memory of a cache per face of the mesh: as much as one unwrap takes beside it at its peak.
const BYTES_A_FACE: usize = 1024;
/// Least memory of a cache, for small meshes.
const LEAST_BYTES: usize = 64 << 20;

/// Kinds of results; each is of one type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Kind {
    /// How far vertices can be seen.
    Visibility,
    /// The charts of a component as they were found.
    Charts,
    /// The charts of a component, touched up.
    TouchedUp,
    /// A coarse mesh.
    Coarse,
    /// Distances on a patch and their spectral analysis.
    Analysis,
    /// How a patch bulges.
    Bulge,
    /// The labels of a patch's parts.
    Segments,
    /// Labels with their borders redrawn.
    Borders,
    /// A patch in the plane by its distances.
    Embedding,
    /// A start without flips.
    Cleared,
    /// The same by its neighbourhood alone.
    LocallyCleared,
    /// A start whose boundary is simple.
    Parted,
    /// A minimum of the stretch.
    Minimum,
}

/// A fingerprint of 128 bits: that two different inputs among n have the same one has a chance of n²·2⁻¹²⁸.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Fingerprint([u64; 2]);

impl Fingerprint {
    pub(crate) fn new() -> Self {
        Self([0x243f_6a88_85a3_08d3, 0x1319_8a2e_0370_7344])
    }

    /// Takes one more word in.
    pub(crate) fn word(&mut self, word: u64) {
        let fold = |x: u64, y: u64| {
            let product = u128::from(x) * u128::from(y);
            #[expect(clippy::cast_possible_truncation, reason = "both halves are used")]
            let (low, high) = (product as u64, (product >> 64) as u64);
            low ^ high
        };
        let [a, b] = self.0;
        // Two odd constants without a pattern; the second lane sees the words in another place.
        self.0 = [fold(a ^ word, 0x9e37_79b9_7f4a_7c15) ^ b, fold(b.rotate_left(23) ^ word, 0xc2b2_ae3d_27d4_eb4f)];
    }

    pub(crate) fn reals(&mut self, values: impl IntoIterator<Item = f64>) {
        let mut count = 0;
        for value in values {
            self.word(value.to_bits());
            count += 1;
        }
        self.word(count);
    }

    pub(crate) fn points(&mut self, points: &[Point2<f64>]) {
        self.reals(points.iter().flat_map(|p| [p.x, p.y]));
    }

    pub(crate) fn indices(&mut self, values: impl IntoIterator<Item = usize>) {
        let mut count = 0;
        for value in values {
            self.word(value as u64);
            count += 1;
        }
        self.word(count);
    }

    pub(crate) fn numbers(&mut self, values: &[u32]) {
        self.indices(values.iter().map(|&v| v as usize));
    }

    pub(crate) fn distances(&mut self, distances: &LandmarkDistances) {
        self.indices(distances.landmarks().iter().map(|v| v.index()));
        for l in 0..distances.len() {
            self.indices(distances.row(l).iter().map(|d| d.to_bits() as usize));
        }
    }

    /// Positions, triangles, how they are glued, where seams weigh how much, and which parts are not to be bent.
    pub(crate) fn mesh(&mut self, mesh: &TriMesh) {
        self.reals(mesh.positions().iter().flat_map(|p| [p.x, p.y, p.z]));
        self.indices(mesh.triangles().iter().flatten().map(|v| v.index()));
        self.indices(mesh.halfedges().map(|h| 2 * mesh.twin(h).index() + usize::from(mesh.is_guide(h))));
        let vertices: Vec<VertexId> = mesh.vertices().collect();
        self.reals(mesh.seam_weights_of(&vertices).into_iter().map(f64::from));
        self.indices(mesh.faces().map(|f| mesh.part(f) as usize));
    }

    /// Settings, by all that they print.
    pub(crate) fn settings(&mut self, settings: &impl std::fmt::Debug) {
        // Floats print with all the digits that tell them apart.
        let text = format!("{settings:?}");
        self.indices(text.bytes().map(usize::from));
    }
}

/// About the memory that a mesh takes.
pub(crate) fn bytes_of(mesh: &TriMesh) -> usize {
    28 * mesh.vertex_count() + 24 * mesh.face_count()
}

struct Entry {
    value: Arc<dyn Any + Send + Sync>,
    bytes: usize,
    /// The call that asked for it last.
    used: u64,
}

#[derive(Default)]
struct Kept {
    entries: HashMap<(Kind, Fingerprint), Entry>,
    bytes: usize,
    call: u64,
}

/// Results of earlier calls, up to a number of bytes; for any number of threads.
pub(crate) struct Cache {
    most_bytes: usize,
    kept: Mutex<Kept>,
}

impl std::fmt::Debug for Cache {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kept = self.lock();
        f.debug_struct("Cache").field("entries", &kept.entries.len()).field("bytes", &kept.bytes).finish()
    }
}

impl Cache {
    /// For a mesh of so many faces.
    pub(crate) fn new(faces: usize) -> Self {
        Self::with_room(faces.saturating_mul(BYTES_A_FACE).max(LEAST_BYTES))
    }

    fn with_room(most_bytes: usize) -> Self {
        Self { most_bytes, kept: Mutex::default() }
    }

    /// No code panics while it holds the lock, and if it did, entries are whole.
    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Another unwrap begins.
    pub(crate) fn begin(&self) {
        self.lock().call += 1;
    }

    fn get(&self, key: (Kind, Fingerprint)) -> Option<Arc<dyn Any + Send + Sync>> {
        let mut kept = self.lock();
        let call = kept.call;
        let entry = kept.entries.get_mut(&key)?;
        entry.used = call;
        Some(Arc::clone(&entry.value))
    }

    /// Keeps a value, in place of an earlier one. Where there is no room, what no call has asked for since the one
    /// before the last is thrown away, and if that is not enough the value is not kept.
    fn put(&self, key: (Kind, Fingerprint), value: Arc<dyn Any + Send + Sync>, bytes: usize) {
        let mut kept = self.lock();
        let Kept { entries, bytes: total, call } = &mut *kept;
        if let Some(old) = entries.remove(&key) {
            *total -= old.bytes;
        }
        if *total + bytes > self.most_bytes {
            entries.retain(|_, e| e.used + 1 >= *call);
            *total = entries.values().map(|e| e.bytes).sum();
        }
        if *total + bytes <= self.most_bytes {
            *total += bytes;
            entries.insert(key, Entry { value, bytes, used: *call });
        }
    }
}

/// One unwrap under way: its progress, and what earlier ones of the same mesh have left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run<'a> {
    pub(crate) progress: &'a Progress,
    cache: Option<&'a Cache>,
}

impl<'a> Run<'a> {
    pub(crate) fn new(progress: &'a Progress, cache: Option<&'a Cache>) -> Self {
        Self { progress, cache }
    }

    /// The result of `compute`, or what it was when all that `input` takes in was the same. `bytes` is about what the
    /// result holds. Errors are not kept.
    pub(crate) fn recall<T: Send + Sync + 'static, E>(
        &self,
        kind: Kind,
        input: impl FnOnce(&mut Fingerprint),
        bytes: impl FnOnce(&T) -> usize,
        compute: impl FnOnce() -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        self.recall_if(kind, input, |_| true, bytes, compute)
    }

    /// The same where not every result that is kept will do: one that `will_do` refuses is computed afresh, and the new
    /// one kept.
    pub(crate) fn recall_if<T: Send + Sync + 'static, E>(
        &self,
        kind: Kind,
        input: impl FnOnce(&mut Fingerprint),
        will_do: impl FnOnce(&T) -> bool,
        bytes: impl FnOnce(&T) -> usize,
        compute: impl FnOnce() -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        let Some(cache) = self.cache else { return compute().map(Arc::new) };
        let mut fingerprint = Fingerprint::new();
        input(&mut fingerprint);
        let key = (kind, fingerprint);
        if let Some(Ok(value)) = cache.get(key).map(Arc::downcast::<T>)
            && will_do(&value)
        {
            return Ok(value);
        }
        let value = Arc::new(compute()?);
        cache.put(key, Arc::clone(&value) as Arc<dyn Any + Send + Sync>, bytes(&value));
        Ok(value)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::mesh::{FaceId, test_surfaces};

    /// Recalls a number made of `input`, and says whether it was computed.
    fn recall(run: &Run<'_>, kind: Kind, input: u64, bytes: usize) -> (u64, bool) {
        let computed = Cell::new(false);
        let compute = || {
            computed.set(true);
            Ok::<_, ()>(10 * input)
        };
        let value = run.recall(kind, |f| f.word(input), |_| bytes, compute).expect("a number");
        (*value, computed.get())
    }

    #[test]
    fn a_result_is_computed_once() {
        let (progress, cache) = (Progress::new(), Cache::new(0));
        let run = Run::new(&progress, Some(&cache));
        assert_eq!(recall(&run, Kind::Coarse, 1, 8), (10, true));
        assert_eq!(recall(&run, Kind::Coarse, 1, 8), (10, false));
        assert_eq!(recall(&run, Kind::Coarse, 2, 8), (20, true));
        assert_eq!(recall(&run, Kind::Analysis, 1, 8), (10, true), "another kind");
        let without = Run::new(&progress, None);
        assert_eq!(recall(&without, Kind::Coarse, 1, 8), (10, true));
    }

    #[test]
    fn errors_are_not_kept_and_what_will_not_do_is_replaced() {
        let (progress, cache) = (Progress::new(), Cache::new(0));
        let run = Run::new(&progress, Some(&cache));
        let ask = |least: u32, give: Result<u32, ()>| {
            run.recall_if(Kind::Minimum, |f| f.word(7), |v| *v >= least, |_| 4, || give).map(|v| *v)
        };
        assert_eq!(ask(0, Err(())), Err(()));
        assert_eq!(ask(0, Ok(3)), Ok(3));
        assert_eq!(ask(2, Ok(9)), Ok(3));
        assert_eq!(ask(4, Ok(9)), Ok(9));
        assert_eq!(ask(4, Err(())), Ok(9));
    }

    #[test]
    fn memory_is_bounded_and_the_last_calls_come_first() {
        let (progress, cache) = (Progress::new(), Cache::with_room(100));
        let run = Run::new(&progress, Some(&cache));
        for call in 0..5 {
            cache.begin();
            for i in 0..3 {
                recall(&run, Kind::Coarse, 10 * call + i, 20);
                assert!(cache.lock().bytes <= 100);
            }
        }
        assert_eq!(recall(&run, Kind::Coarse, 42, 20), (420, false), "of the last call");
        assert_eq!(recall(&run, Kind::Coarse, 2, 20), (20, true), "long ago");
        assert_eq!(recall(&run, Kind::Coarse, 99, 101), (990, true));
        assert_eq!(recall(&run, Kind::Coarse, 99, 101), (990, true), "larger than all room");
        let sum: usize = cache.lock().entries.values().map(|e| e.bytes).sum();
        assert_eq!(sum, cache.lock().bytes);
    }

    #[test]
    fn fingerprints_see_everything_that_makes_a_mesh() {
        let print = |mesh: &TriMesh| {
            let mut f = Fingerprint::new();
            f.mesh(mesh);
            f
        };
        let mesh = test_surfaces::grid(4, 4, [1.0, 1.0], 0.0);
        let all: Vec<FaceId> = mesh.faces().collect();
        assert_eq!(print(&mesh), print(&mesh.submesh(&all, |_| false).0));
        // A cut of one edge inside leaves positions and triangles as they are.
        let inner = mesh.edges().find(|&h| !mesh.is_boundary(h)).expect("an inner edge");
        let ends = [mesh.from(inner), mesh.to(inner)];
        let slit = mesh.submesh(&all, |h| h == inner || h == mesh.twin(inner)).0;
        let guided = {
            let marks = mesh.halfedges().map(|h| h == inner || h == mesh.twin(inner)).collect();
            mesh.clone().with_guides(marks)
        };
        assert!(!ends.iter().all(|v| mesh.is_boundary_vertex(*v)));
        let prints = [print(&mesh), print(&slit), print(&guided), print(&mesh.submesh(&all[1..], |_| false).0)];
        for (i, a) in prints.iter().enumerate() {
            assert!(prints[..i].iter().all(|b| a != b), "{i}");
        }
        let words = |words: &[u64]| {
            let mut f = Fingerprint::new();
            words.iter().for_each(|w| f.word(*w));
            f
        };
        assert!(words(&[0]) != words(&[0, 0]) && words(&[1, 2]) != words(&[2, 1]));
        let mut many: Vec<[u64; 2]> = (0..20_000).map(|i| words(&[i / 150, i % 150]).0).collect();
        many.sort_unstable();
        many.dedup();
        assert_eq!(many.len(), 20_000);
    }
}
