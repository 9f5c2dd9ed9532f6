//! How much memory an unwrap takes, before it begins.

use crate::linalg::bytes_of_packing_buffers;
use crate::memory::{self, OutOfMemory};
use crate::mesh::MeshInput;
use crate::settings::Settings;

/// What a triangle takes at the peak, in bytes: the most that `make scaling` measures on meshes of 64,000 triangles and
/// more, with nearly a half to spare.
const OF_TRIANGLE: u64 = 1536;
/// What each connected piece takes besides, in bytes: a chart of its own, in many poses while packing is searched. 20,000
/// triangles apart take 7.4 KiB each in all.
const OF_PIECE: u64 = 8 << 10;
/// What each thread takes besides, whatever the mesh: its stack, its share of the allocator's address space, its scratch
/// arrays.
const OF_THREAD: u64 = 80 << 20;
/// Arrays of k×k numbers that scaling k landmarks holds at once: distances, their squares, the centred matrix, its
/// eigenvectors and their scratch.
const SQUARES: u64 = 8;

/// Fails if an unwrap of a mesh of so many connected pieces, as far as that is known, is going to take more memory than the
/// platform says is left.
pub(super) fn require(input: &MeshInput<'_>, pieces: usize, settings: &Settings) -> Result<(), OutOfMemory> {
    memory::require(of_unwrap(input, pieces, settings))
}

/// An estimate on the safe side, in bytes. Textures do not enter: the grids of packing have a bounded number of cells.
fn of_unwrap(input: &MeshInput<'_>, pieces: usize, settings: &Settings) -> u64 {
    let faces = input.face_offsets.len().saturating_sub(1);
    let triangles = input.corner_vertices.len().saturating_sub(2 * faces) as u64;
    let threads = rayon::current_num_threads();
    let landmarks = if settings.coarse { 0 } else { of_landmarks(input.positions.len(), settings) };
    (triangles.saturating_mul(OF_TRIANGLE))
        .saturating_add((pieces as u64).saturating_mul(OF_PIECE))
        .saturating_add(landmarks)
        .saturating_add((threads as u64).saturating_mul(OF_THREAD))
        .saturating_add(bytes_of_packing_buffers(threads))
}

/// Distances from the landmarks of all vertices taken as one patch; on the coarse mesh they are few.
fn of_landmarks(vertices: usize, settings: &Settings) -> u64 {
    let all = vertices <= settings.together_max;
    let count = if all { vertices } else { settings.geodesics.landmark_count(vertices) };
    let (n, k) = (vertices as u64, count as u64);
    let block = n.saturating_mul(k).saturating_mul(size_of::<f32>() as u64);
    let squares = k.saturating_mul(k).saturating_mul(SQUARES * size_of::<f64>() as u64);
    block.saturating_add(squares)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn need(faces: usize, settings: &Settings) -> u64 {
        let positions = vec![[0.0; 3]; faces];
        let offsets: Vec<i32> = (0..=faces as i32).map(|f| 3 * f).collect();
        let corners = vec![0; 3 * faces];
        let input = MeshInput {
            positions: &positions,
            corner_vertices: &corners,
            face_offsets: &offsets,
            ..MeshInput::default()
        };
        of_unwrap(&input, 1, settings)
    }

    #[test]
    fn the_need_grows_with_triangles_and_landmarks() {
        let usual = Settings::default();
        assert_eq!(need(5000, &usual) - need(1000, &usual), 4000 * OF_TRIANGLE);
        let mut many = Settings { coarse: false, ..Settings::default() };
        many.geodesics.landmark_min = 3000;
        many.geodesics.landmark_max = 3000;
        let block = 5000 * 3000 * 4 + SQUARES * 8 * 3000 * 3000;
        assert_eq!(need(5000, &many) - need(5000, &usual), block);
        many.geodesics.landmark_min = usize::MAX;
        assert!(need(5000, &many) > need(5000, &usual));
    }
}
