//! The cheapest set of edges between two sides of a graph.
//!
//! A. V. Goldberg, R. E. Tarjan: A new approach to the maximum-flow problem, J. ACM 35 (1988), 921–940:
//! flow is pushed downhill along labels that bound the distance to a terminal from below. With the
//! choice of the highest node, exact labels from time to time, and the gap rule (B. V. Cherkassky,
//! A. V. Goldberg, On implementing the push-relabel method, Algorithmica 19, 1997). Only the first of
//! its two phases is needed for a cut. At most O(n²√m). With random capacities, 100,000 nodes take
//! 0.2 s in a band ten nodes wide between the terminals and 0.7 s in a square between opposite sides;
//! where a line is clearly cheapest, a fifth of that. (Boykov and Kolmogorov's trees, usual in vision,
//! took 5 s for that square, and 145 s for one four times as large.)

use crate::progress::{Cancelled, Progress};

/// Capacity of an edge to a terminal that no cut through other edges can outweigh.
const UNBOUNDED: i64 = 1 << 60;

/// Arcs and labels looked at, in multiples of the size of the graph, before labels are made exact.
const WORK_BETWEEN_EXACT_LABELS: usize = 2;

/// Nodes discharged between two looks at the cancel flag.
const CHECK_EVERY: usize = 1024;

/// End of a list of nodes.
const NONE: u32 = u32::MAX;

/// A graph to be cut in two: nodes, undirected edges with capacities, and capacities from each node to
/// the two terminals, source and sink. Capacities are integers, so that the cut does not depend on
/// rounding or on the order of sums.
#[derive(Clone, Debug)]
pub(crate) struct CutGraph {
    edges: Vec<(u32, u32, i64)>,
    /// Capacity from the source and to the sink.
    terminals: Vec<[i64; 2]>,
}

impl CutGraph {
    /// Larger capacities count as this: sums over all edges of a graph must not overflow.
    pub(crate) const MAX_CAPACITY: u64 = 1 << 30;

    /// A graph of `n` nodes without edges.
    #[must_use]
    pub(crate) fn new(n: usize) -> Self {
        Self { edges: Vec::new(), terminals: vec![[0; 2]; n] }
    }

    /// Joins two nodes: `capacity` is what it costs to have them on different sides. Several edges
    /// between the same nodes add up; loops cost nothing.
    ///
    /// # Panics
    /// If a node is not there.
    pub(crate) fn add_edge(&mut self, u: usize, v: usize, capacity: u64) {
        let n = self.terminals.len();
        assert!(u < n && v < n, "edge between nodes {u} and {v} of {n}");
        if u != v && capacity > 0 {
            self.edges.push((u as u32, v as u32, capacity.min(Self::MAX_CAPACITY) as i64));
        }
    }

    /// Joins a node to the terminals: `source` is what it costs to have it on the sink's side, `sink`
    /// what it costs on the source's. Repeated calls add up.
    ///
    /// # Panics
    /// If the node is not there.
    pub(crate) fn add_terminals(&mut self, u: usize, source: u64, sink: u64) {
        for (sum, capacity) in self.terminals[u].iter_mut().zip([source, sink]) {
            *sum = (*sum + capacity.min(Self::MAX_CAPACITY) as i64).min(UNBOUNDED);
        }
    }

    /// Puts a node on the source's side, whatever it costs (unless it is fixed to the sink as well).
    ///
    /// # Panics
    /// If the node is not there.
    pub(crate) fn fix_to_source(&mut self, u: usize) {
        self.terminals[u][0] = UNBOUNDED;
    }

    /// Puts a node on the sink's side, whatever it costs (unless it is fixed to the source as well).
    ///
    /// # Panics
    /// If the node is not there.
    pub(crate) fn fix_to_sink(&mut self, u: usize) {
        self.terminals[u][1] = UNBOUNDED;
    }

    /// Whether each node lies on the source's side of a minimum cut; of all minimum cuts the one whose
    /// source side is smallest (it is contained in all others), so the answer is unique. Nodes that
    /// neither terminal reaches lie on the sink's side.
    ///
    /// # Errors
    /// [`Cancelled`] if `progress` says so.
    pub(crate) fn min_cut(self, progress: &Progress) -> Result<Vec<bool>, Cancelled> {
        Ok(self.max_flow(progress)?.1)
    }

    /// The value of the minimum cut, which is that of the maximum flow, with the cut of
    /// [`CutGraph::min_cut`].
    ///
    /// # Errors
    /// [`Cancelled`] if `progress` says so.
    pub(crate) fn max_flow(self, progress: &Progress) -> Result<(u128, Vec<bool>), Cancelled> {
        let mut search = Preflow::new(&self);
        search.run(progress)?;
        let side = search.labels_from_goal();
        Ok((search.flow, side))
    }
}

#[derive(Clone, Copy, Debug)]
struct Arc {
    to: u32,
    /// The arc the other way.
    back: u32,
    residual: i64,
}

/// Flow runs from the sink to the source, which is the same here, edges having no direction: the nodes
/// that can still reach the goal of the flow in the end are then the smallest source side.
struct Preflow {
    /// Arcs by the node they leave.
    offsets: Vec<u32>,
    arcs: Vec<Arc>,
    /// Flow that has arrived at a node and not left it.
    excess: Vec<i64>,
    /// What a node can still pass to the goal directly.
    to_goal: Vec<i64>,
    /// At most the number of arcs to the goal; n + 1 where it is out of reach.
    label: Vec<u32>,
    /// Arcs before this one lead nowhere under the present labels.
    current: Vec<u32>,
    /// Nodes by label, doubly linked; and of these, those with excess, singly linked.
    first: Vec<u32>,
    next: Vec<u32>,
    previous: Vec<u32>,
    first_active: Vec<u32>,
    next_active: Vec<u32>,
    highest: usize,
    highest_active: usize,
    work: usize,
    flow: u128,
}

impl Preflow {
    fn new(graph: &CutGraph) -> Self {
        let n = graph.terminals.len();
        let mut offsets = vec![0u32; n + 1];
        for &(u, v, _) in &graph.edges {
            offsets[u as usize + 1] += 1;
            offsets[v as usize + 1] += 1;
        }
        for u in 0..n {
            offsets[u + 1] += offsets[u];
        }
        let mut place = offsets.clone();
        let mut arcs = vec![Arc { to: 0, back: 0, residual: 0 }; 2 * graph.edges.len()];
        for &(u, v, residual) in &graph.edges {
            let (there, back) = (place[u as usize], place[v as usize]);
            arcs[there as usize] = Arc { to: v, back, residual };
            arcs[back as usize] = Arc { to: u, back: there, residual };
            place[u as usize] += 1;
            place[v as usize] += 1;
        }
        let (source, sink) = (|u: usize| graph.terminals[u][0], |u: usize| graph.terminals[u][1]);
        Self {
            offsets,
            arcs,
            excess: (0..n).map(|u| (sink(u) - source(u)).max(0)).collect(),
            to_goal: (0..n).map(|u| (source(u) - sink(u)).max(0)).collect(),
            label: vec![0; n],
            current: vec![0; n],
            first: vec![NONE; n + 2],
            next: vec![NONE; n],
            previous: vec![NONE; n],
            first_active: vec![NONE; n + 2],
            next_active: vec![NONE; n],
            highest: 0,
            highest_active: 0,
            work: 0,
            flow: (0..n).map(|u| source(u).min(sink(u)) as u128).sum(),
        }
    }

    /// The label of nodes that cannot reach the goal; a way through all nodes has length n.
    fn dead(&self) -> u32 {
        self.label.len() as u32 + 1
    }

    fn arcs_of(&self, u: usize) -> std::ops::Range<usize> {
        self.offsets[u] as usize..self.offsets[u + 1] as usize
    }

    fn run(&mut self, progress: &Progress) -> Result<(), Cancelled> {
        let n = self.label.len();
        let limit = WORK_BETWEEN_EXACT_LABELS * n + self.arcs.len();
        self.labels_from_goal();
        let mut discharged = 0usize;
        loop {
            let u = self.first_active[self.highest_active] as usize;
            if u == NONE as usize {
                if self.highest_active == 0 {
                    return Ok(());
                }
                self.highest_active -= 1;
                continue;
            }
            self.first_active[self.highest_active] = self.next_active[u];
            if discharged.is_multiple_of(CHECK_EVERY) {
                progress.check()?;
            }
            discharged += 1;
            self.discharge(u);
            if self.work > limit {
                self.labels_from_goal();
            }
        }
    }

    /// Makes all labels exact and sorts the nodes by them. Returns which nodes can reach the goal.
    fn labels_from_goal(&mut self) -> Vec<bool> {
        let (n, dead) = (self.label.len(), self.dead());
        self.label.fill(dead);
        self.first.fill(NONE);
        self.first_active.fill(NONE);
        (self.work, self.highest, self.highest_active) = (0, 0, 0);
        let mut queue: Vec<u32> = (0..n as u32).filter(|&u| self.to_goal[u as usize] > 0).collect();
        for &u in &queue {
            self.label[u as usize] = 1;
        }
        let mut head = 0;
        while let Some(&u) = queue.get(head) {
            head += 1;
            let u = u as usize;
            self.file(u);
            if self.excess[u] > 0 {
                self.activate(u);
            }
            for a in self.arcs_of(u) {
                let Arc { to, back, .. } = self.arcs[a];
                if self.label[to as usize] == dead
                    && self.to_goal[to as usize] == 0
                    && self.arcs[back as usize].residual > 0
                {
                    self.label[to as usize] = self.label[u] + 1;
                    queue.push(to);
                }
            }
        }
        let mut reaches = vec![false; n];
        for u in queue {
            reaches[u as usize] = true;
        }
        reaches
    }

    /// Puts a node into the list of its label, with all arcs to be tried again.
    fn file(&mut self, u: usize) {
        let label = self.label[u] as usize;
        self.current[u] = self.offsets[u];
        let second = self.first[label];
        self.next[u] = second;
        self.previous[u] = NONE;
        if second != NONE {
            self.previous[second as usize] = u as u32;
        }
        self.first[label] = u as u32;
        self.highest = self.highest.max(label);
    }

    /// Takes a node out of the list of its label.
    fn unfile(&mut self, u: usize) {
        let (before, after) = (self.previous[u], self.next[u]);
        if before == NONE {
            self.first[self.label[u] as usize] = after;
        } else {
            self.next[before as usize] = after;
        }
        if after != NONE {
            self.previous[after as usize] = before;
        }
    }

    fn activate(&mut self, u: usize) {
        let label = self.label[u] as usize;
        self.next_active[u] = self.first_active[label];
        self.first_active[label] = u as u32;
        self.highest_active = self.highest_active.max(label);
    }

    /// Pushes the excess of a node downhill, raising it until all has left or the goal is out of reach.
    fn discharge(&mut self, u: usize) {
        let dead = self.dead();
        loop {
            if self.to_goal[u] > 0 {
                let amount = self.excess[u].min(self.to_goal[u]);
                self.to_goal[u] -= amount;
                self.excess[u] -= amount;
                self.flow += amount as u128;
                if self.excess[u] == 0 {
                    return;
                }
            }
            let end = self.offsets[u + 1] as usize;
            let mut a = self.current[u] as usize;
            while a < end {
                let Arc { to, back, residual } = self.arcs[a];
                if residual > 0 && self.label[to as usize] + 1 == self.label[u] {
                    let amount = residual.min(self.excess[u]);
                    self.arcs[a].residual -= amount;
                    self.arcs[back as usize].residual += amount;
                    if self.excess[to as usize] == 0 {
                        self.activate(to as usize);
                    }
                    self.excess[to as usize] += amount;
                    self.excess[u] -= amount;
                    if self.excess[u] == 0 {
                        break;
                    }
                }
                a += 1;
            }
            self.current[u] = a as u32;
            if self.excess[u] == 0 {
                return;
            }
            // Raise it above its lowest residual neighbour.
            let range = self.arcs_of(u);
            self.work += range.len() + 12;
            let lowest =
                range.filter(|&a| self.arcs[a].residual > 0).map(|a| self.label[self.arcs[a].to as usize]).min();
            let old = self.label[u] as usize;
            self.unfile(u);
            if self.first[old] == NONE {
                // No node is left at this height: from above nothing can flow to the goal any more.
                self.label[u] = dead;
                for label in old + 1..=self.highest {
                    let mut v = std::mem::replace(&mut self.first[label], NONE);
                    while v != NONE {
                        self.label[v as usize] = dead;
                        v = self.next[v as usize];
                    }
                    self.first_active[label] = NONE;
                }
                self.highest = old;
                self.highest_active = self.highest_active.min(old);
                return;
            }
            self.label[u] = lowest.map_or(dead, |l| (l + 1).min(dead));
            if self.label[u] == dead {
                return;
            }
            self.file(u);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cost(graph: &CutGraph, is_source: impl Fn(usize) -> bool) -> u128 {
        let ends: i64 = graph.terminals.iter().enumerate().map(|(u, t)| t[usize::from(is_source(u))]).sum();
        let cut = graph.edges.iter().filter(|e| is_source(e.0 as usize) != is_source(e.1 as usize));
        (ends + cut.map(|e| e.2).sum::<i64>()) as u128
    }

    fn solve(graph: &CutGraph) -> (u128, Vec<bool>) {
        graph.clone().max_flow(&Progress::new()).expect("not cancelled")
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn agrees_with_trying_every_cut(
            n in 1..9usize,
            edges in prop::collection::vec((0..9usize, 0..9usize, 0..12u64), 0..30),
            terminals in prop::collection::vec((0..15u64, 0..15u64), 9),
        ) {
            let mut graph = CutGraph::new(n);
            for (u, v, c) in edges {
                graph.add_edge(u % n, v % n, c);
            }
            for u in 0..n {
                // Many nodes without terminals, so that paths are long.
                let (s, t) = terminals[u];
                graph.add_terminals(u, s.saturating_sub(8), t.saturating_sub(8));
            }
            let costs: Vec<u128> = (0..1usize << n).map(|set| cost(&graph, |u| set >> u & 1 == 1)).collect();
            let least = *costs.iter().min().expect("at least one cut");
            // The intersection of the source sides of all minimum cuts is one of them.
            let closest = (0..costs.len()).filter(|&set| costs[set] == least).fold(usize::MAX, |a, b| a & b);
            let (flow, side) = solve(&graph);
            prop_assert_eq!(flow, least);
            prop_assert_eq!(side, (0..n).map(|u| closest >> u & 1 == 1).collect::<Vec<_>>());
        }
    }

    /// A grid of `m`×`m` nodes, its left column at the source and its right one at the sink.
    fn grid(m: usize, capacity: impl Fn(usize, usize) -> u64) -> CutGraph {
        let mut graph = CutGraph::new(m * m);
        for u in 0..m * m {
            if u % m + 1 < m {
                graph.add_edge(u, u + 1, capacity(u, 0));
            }
            if u + m < m * m {
                graph.add_edge(u, u + m, capacity(u, 1));
            }
        }
        for row in 0..m {
            graph.fix_to_source(row * m);
            graph.fix_to_sink(row * m + m - 1);
        }
        graph
    }

    #[test]
    fn finds_the_weak_line_of_a_grid() {
        // Edges from column 30 to 31 cost 3, all others 7.
        let m = 80;
        let graph = grid(m, |u, direction| if u % m == 30 && direction == 0 { 3 } else { 7 });
        let (flow, side) = solve(&graph);
        assert_eq!(flow, 3 * m as u128);
        assert!((0..m * m).all(|u| side[u] == (u % m <= 30)));
    }

    #[test]
    fn value_is_the_cost_of_the_cut_on_a_rough_grid() {
        let graph = grid(100, |u, d| 1 + ((u * 2 + d) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) % 1000);
        let (flow, side) = solve(&graph);
        let ends = (0..graph.terminals.len()).filter(|&u| graph.terminals[u][usize::from(side[u])] == UNBOUNDED);
        assert_eq!(ends.count(), 0, "what is fixed stays");
        assert_eq!(flow, cost(&graph, |u| side[u]));
        assert_eq!(graph.clone().min_cut(&Progress::new()).expect("not cancelled"), side);
    }

    #[test]
    fn large_capacities_do_not_overflow() {
        let mut graph = CutGraph::new(3);
        for _ in 0..100 {
            graph.add_edge(0, 1, u64::MAX);
            graph.add_terminals(2, u64::MAX, u64::MAX);
        }
        graph.fix_to_source(0);
        graph.fix_to_source(1);
        graph.fix_to_sink(1);
        let (flow, side) = solve(&graph);
        // Node 1 is fixed to both, node 2 balanced: only the edges are left to cut.
        assert_eq!(flow, UNBOUNDED as u128 + 100 * u128::from(CutGraph::MAX_CAPACITY));
        assert_eq!(side, [true, true, false]);
    }

    #[test]
    fn nothing_and_cancel() {
        assert_eq!(solve(&CutGraph::new(0)), (0, vec![]));
        assert_eq!(solve(&CutGraph::new(2)), (0, vec![false, false]));
        let progress = Progress::new();
        progress.cancel();
        assert_eq!(grid(100, |_, _| 1).min_cut(&progress), Err(Cancelled::OnRequest));
    }
}
