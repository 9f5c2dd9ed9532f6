//! Pieces worked on in rounds, until each is made into something or divided so far that its parts are.

use rayon::prelude::*;

use crate::progress::Cancelled;

/// What became of a piece.
pub(crate) enum Outcome<M, P> {
    /// It has been made into this.
    Made(M),
    /// It has been divided into other pieces, each of them smaller or nearer to being made.
    Divided(Vec<P>),
}

/// What has been made of all pieces.
pub(crate) struct Rounds<M, N> {
    /// In the order in which they were made, each with the number of the division that it came out of, if any: the same for both
    /// halves of a division in two, and else for no other.
    pub(crate) made: Vec<(M, Option<u32>)>,
    /// What the steps have noted, one after the other.
    pub(crate) notes: Vec<N>,
    /// Numbers of divisions are below this.
    pub(crate) divisions: u32,
}

/// Takes a step with every piece, in parallel, then with all parts of those that were divided, and so on. In each round the pieces
/// are begun in ascending order of `key`, so that no long one starts last. Every thread has a scratch of its own.
///
/// The result does not depend on the number of threads. It ends if no chain of divisions, each of a part of the one before, goes on for ever.
///
/// # Errors
/// The first error of a step.
pub(crate) fn until_made<P, M, N, K, S>(
    pieces: Vec<P>,
    key: impl Fn(&P) -> K,
    scratch: impl Fn() -> S + Sync + Send,
    step: impl Fn(&P, &mut S) -> Result<(Outcome<M, P>, N), Cancelled> + Sync + Send,
) -> Result<Rounds<M, N>, Cancelled>
where
    P: Sync,
    M: Send,
    N: Send,
    K: Ord,
    Outcome<M, P>: Send,
{
    let mut open: Vec<(P, Option<u32>)> = pieces.into_iter().map(|piece| (piece, None)).collect();
    let mut rounds = Rounds { made: Vec::new(), notes: Vec::new(), divisions: 0 };
    while !open.is_empty() {
        open.sort_by_key(|(piece, _)| key(piece));
        let steps: Vec<Result<_, Cancelled>> =
            open.par_iter().with_max_len(1).map_init(&scratch, |scratch, (piece, _)| step(piece, scratch)).collect();
        let mut next = Vec::new();
        for ((_, division), taken) in open.iter().zip(steps) {
            let (outcome, note) = taken?;
            rounds.notes.push(note);
            match outcome {
                Outcome::Made(made) => rounds.made.push((made, *division)),
                Outcome::Divided(parts) => {
                    let are_halves = parts.len() == 2;
                    for part in parts {
                        next.push((part, Some(rounds.divisions)));
                        rounds.divisions += u32::from(!are_halves);
                    }
                    rounds.divisions += 1;
                }
            }
        }
        open = next;
    }
    Ok(rounds)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers divided into parts until they are at most 2; the steps note what they saw.
    fn divided(numbers: Vec<u32>, parts: u32) -> Rounds<u32, u32> {
        let step = |&n: &u32, _: &mut ()| {
            let outcome = if n <= 2 {
                Outcome::Made(n)
            } else {
                let share = |k: u32| n / parts + u32::from(k < n % parts);
                Outcome::Divided((0..parts).map(share).filter(|n| *n > 0).collect())
            };
            Ok((outcome, n))
        };
        until_made(numbers, |n| std::cmp::Reverse(*n), || (), step).expect("not cancelled")
    }

    #[test]
    fn all_that_was_there_is_made() {
        let rounds = divided(vec![7, 1, 12], 2);
        assert_eq!(rounds.made.iter().map(|m| m.0).sum::<u32>(), 20);
        assert!(rounds.made.iter().all(|m| m.0 <= 2));
        assert_eq!(rounds.notes[..3], [12, 7, 1], "the largest first");
    }

    #[test]
    fn only_halves_share_a_division() {
        let shared = |rounds: &Rounds<u32, u32>| {
            let mut numbers: Vec<u32> = rounds.made.iter().filter_map(|m| m.1).collect();
            assert!(numbers.iter().all(|n| *n < rounds.divisions));
            numbers.sort_unstable();
            numbers.chunk_by(|a, b| a == b).map(<[u32]>::len).max()
        };
        assert_eq!(shared(&divided(vec![4], 2)), Some(2));
        assert_eq!(shared(&divided(vec![6], 3)), Some(1));
        assert_eq!(divided(vec![2], 2).made, [(2, None)]);
    }

    #[test]
    fn an_error_ends_it() {
        let step = |n: &u32, _: &mut ()| {
            if *n == 3 { Err(Cancelled::OnRequest) } else { Ok((Outcome::<u32, u32>::Made(*n), ())) }
        };
        assert!(until_made(vec![1, 2, 3, 4], |n| *n, || (), step).is_err());
    }
}
