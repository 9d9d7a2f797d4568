//! Which stretches show the same animal: the probability of each to continue each earlier one.
//!
//! Every stretch continues at most one and is continued by at most one. The marginal probabilities of all such
//! pairings are computed by belief propagation (Williams & Lau 2014, "Approximate evaluation of marginal association
//! probabilities with belief propagation"). Where two alike bodies meet and part, each continuation has about one
//! half. A leap to a body that has a better origin has about none.

use super::motion::Motion;
use super::stretch::Stretch;

/// Number of later stretches that may continue one. Free choice: it bounds the memory.
const N_NEXT: usize = 64;
/// Rounds of belief propagation. Free choice: it bounds the time.
const N_ROUNDS: usize = 20;

/// A stretch that may continue another.
struct Link {
    from: usize,
    to: usize,
    /// Probability, 0..=1; until it is known, the ratio of its likelihood to that of two different bodies.
    p: f64,
}

/// The stretches that show one body each, and which of them show the same.
pub(super) struct Identity<'a> {
    bodies: &'a [&'a Stretch],
    links: Vec<Link>,
    /// Usual number of other bodies in view.
    n_others: usize,
}

impl<'a> Identity<'a> {
    /// Pairs the bodies, which are ordered by first frame. `n_others` is the usual number of others in view.
    pub(super) fn new(bodies: &'a [&'a Stretch], n_others: usize) -> Identity<'a> {
        let motion = Motion::learn(bodies);
        let others = density_of_others(bodies, n_others);
        let mut links = Vec::new();
        for (from, a) in bodies.iter().enumerate() {
            let later = (from + 1..).zip(&bodies[from + 1..]);
            let next = later.filter(|(_, b)| a.may_go_on_as(b));
            for (to, b) in next.take(N_NEXT) {
                let p = motion.density(a, b) / others;
                links.push(Link { from, to, p });
            }
        }
        propagate(&mut links, bodies.len());
        Identity {
            bodies,
            links,
            n_others,
        }
    }

    /// Returns for each body the probability that it is the same as body `anchor`.
    ///
    /// If there is usually no other, the likelier case is certain.
    pub(super) fn same_as(&self, anchor: usize) -> Vec<f64> {
        let mut later = vec![0.0; self.bodies.len()];
        let mut earlier = later.clone();
        later[anchor] = 1.0;
        earlier[anchor] = 1.0;
        for link in &self.links {
            later[link.to] += link.p * later[link.from];
        }
        for link in self.links.iter().rev() {
            earlier[link.from] += link.p * earlier[link.to];
        }
        let best = later.into_iter().zip(earlier);
        let best = best.map(|(a, b)| a.max(b).min(1.0));
        best.map(|p| if self.n_others == 0 { p.round() } else { p })
            .collect()
    }
}

/// Returns the density with which `n_others` other bodies come into view, per frame and square pixel: each comes once
/// in the film. The least value keeps ratios finite.
fn density_of_others(bodies: &[&Stretch], n_others: usize) -> f64 {
    let n_frames = bodies.iter().map(|body| body.end()).max().unwrap_or(0);
    let range_px = [0, 1].map(|axis| {
        let places = bodies.iter().flat_map(|body| &body.places_px);
        let along = places.map(|place| place[axis]);
        let (low, high) = along.fold((f64::MAX, f64::MIN), |(low, high), at| {
            (low.min(at), high.max(at))
        });
        (high - low).max(1.0)
    });
    let volume = n_frames.max(1) as f64 * range_px[0] * range_px[1];
    (n_others as f64 / volume).max(f64::EPSILON)
}

/// Turns the likelihood ratios of the links into probabilities.
///
/// Each link carries two messages: how much its start asks for its end, given the other ends, and how free its end
/// is, given the other starts.
fn propagate(links: &mut [Link], n_bodies: usize) {
    let mut asked = vec![0.0; links.len()];
    let mut free = vec![1.0; links.len()];
    for _ in 0..N_ROUNDS {
        let mut of_start = vec![0.0; n_bodies];
        let mut of_end = vec![0.0; n_bodies];
        for (link, free) in links.iter().zip(&free) {
            of_start[link.from] += link.p * free;
        }
        for ((link, free), asked) in links.iter().zip(&free).zip(&mut asked) {
            *asked = link.p / (1.0 + (of_start[link.from] - link.p * free).max(0.0));
            of_end[link.to] += *asked;
        }
        for ((link, free), asked) in links.iter().zip(&mut free).zip(&asked) {
            *free = 1.0 / (1.0 + (of_end[link.to] - asked).max(0.0));
        }
    }
    let mut of_start = vec![0.0; n_bodies];
    for (link, free) in links.iter().zip(&free) {
        of_start[link.from] += link.p * free;
    }
    for (link, free) in links.iter_mut().zip(&free) {
        link.p *= free / (1.0 + of_start[link.from]);
    }
}
