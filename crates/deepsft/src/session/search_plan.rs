//! Which targets the finders look for in a frame.

use super::exchange::{Question, TargetId};
use std::collections::{BTreeMap, VecDeque};

/// Correlation from which a followed target needs no finder soon.
const SURE: f64 = 0.6;

/// After so long it is looked for all the same, seconds: a track may sit in a wrong fold.
const CONFIRM_S: f64 = 2.0;

/// What one search of missing targets should take at most, seconds; one target is looked for in any case.
const BUDGET_S: f64 = 0.3;

/// How long the finders rest after an answer beside which frames are missed, in times of that answer; at most [`CONFIRM_S`].
const REST: f64 = 1.2;

/// So long after a missed frame the processor counts as too slow for tracker and finders, seconds.
const BUSY_S: f64 = 2.0;

/// From so many times of the fastest search of the same kind on the device has become slow, as phones do when they get hot, if so many
/// searches in a row took so long.
const SLOWED: f64 = 2.0;
const SLOW_SEARCHES: usize = 3;

/// Seconds of a search below which times are not compared.
const MIN_TIMED_S: f64 = 1e-3;

/// Spends the finders on the targets that are missing, in turn, as many at once as a search may take time for.
///
/// A target that is followed is confirmed now and then, at once when the image does not confirm it, and in between when nothing is missing
/// and it has a network, which also denies.
#[derive(Debug, Default)]
pub(super) struct SearchPlan {
    targets: BTreeMap<TargetId, Searched>,
    /// Of the last search, for each target.
    each_s: f64,
    /// The fastest search of each kind while something was followed.
    fastest_s: BTreeMap<Kind, f64>,
    /// How many times as long as the fastest the last searches took.
    slowness: VecDeque<f64>,
    rest_until_s: f64,
}

#[derive(Debug)]
struct Searched {
    can_deny: bool,
    /// Its correlation while it is followed.
    followed: Option<f64>,
    /// When it was last looked for in this video.
    asked_s: f64,
    /// How many searches there had been when it was last looked for, this one included.
    turn: u64,
}

/// Searches take about as long when they only confirm, or not, and look for so many targets with a network and without.
type Kind = (bool, usize, usize);

impl SearchPlan {
    pub(super) fn add(&mut self, id: TargetId, can_deny: bool) {
        let searched = Searched {
            can_deny,
            followed: None,
            asked_s: f64::NEG_INFINITY,
            turn: 0,
        };
        self.targets.insert(id, searched);
    }

    pub(super) fn remove(&mut self, id: TargetId) {
        self.targets.remove(&id);
        if !self.follows_some() {
            self.rest_until_s = f64::NEG_INFINITY;
        }
    }

    pub(super) fn follows_some(&self) -> bool {
        self.targets.values().any(|searched| searched.followed.is_some())
    }

    pub(super) fn misses_some(&self) -> bool {
        self.targets.values().any(|searched| searched.followed.is_none())
    }

    /// Whether a search only confirms: each target has a network and is followed well.
    pub(super) fn only_confirms(&self, ids: &[TargetId]) -> bool {
        let confirms = |searched: &Searched| searched.can_deny && searched.followed.is_some_and(|c| c >= SURE);
        ids.iter().all(|id| self.targets.get(id).is_some_and(confirms))
    }

    /// What the tracker says of a target: its correlation, if it is followed. One that was just lost ends the finders' rest.
    pub(super) fn tracked(&mut self, id: TargetId, followed: Option<f64>) {
        let Some(searched) = self.targets.get_mut(&id) else {
            return;
        };
        if searched.followed.is_some() && followed.is_none() {
            self.rest_until_s = f64::NEG_INFINITY;
        }
        searched.followed = followed;
    }

    /// Another video begins, whose clock may be another: nothing was looked for in it yet. The targets keep their turns.
    pub(super) fn restart(&mut self) {
        self.rest_until_s = f64::NEG_INFINITY;
        for searched in self.targets.values_mut() {
            (searched.followed, searched.asked_s) = (None, f64::NEG_INFINITY);
        }
    }

    /// The targets to look for now; none while all are followed well, or the finders rest.
    pub(super) fn next(&self, now_s: f64) -> Vec<TargetId> {
        if now_s < self.rest_until_s {
            return Vec::new();
        }
        let mut in_turn: Vec<_> = self.targets.iter().collect();
        in_turn.sort_by_key(|(_, searched)| searched.turn);
        let misses_some = self.misses_some();
        let is_due = |searched: &Searched| {
            searched.followed.is_some_and(|correlation| {
                let is_sure = correlation >= SURE && (!searched.can_deny || misses_some);
                !is_sure || now_s - searched.asked_s >= CONFIRM_S
            })
        };
        let at_once = (BUDGET_S / self.each_s.max(MIN_TIMED_S)).max(1.0) as usize;
        let missing = in_turn.iter().filter(|(_, searched)| searched.followed.is_none());
        let due = in_turn.iter().filter(|(_, searched)| is_due(searched));
        missing.take(at_once).chain(due.take(1)).map(|(id, _)| **id).collect()
    }

    /// The finders look for the targets `ids` now.
    pub(super) fn asked(&mut self, ids: &[TargetId], now_s: f64) {
        let last = self.targets.values().map(|searched| searched.turn).max();
        for id in ids {
            if let Some(searched) = self.targets.get_mut(id) {
                (searched.asked_s, searched.turn) = (now_s, last.unwrap_or(0) + 1);
            }
        }
    }

    /// A search that took `took_s` is over.
    ///
    /// The finders rest now, if something is followed: what is followed they confirm, what is missing everything waits for. A processor
    /// with too few cores for both serves the tracker first. On a device that has become slow they work as small a part of the time as it
    /// has become slower: less heat, and the tracker keeps its rate.
    pub(super) fn took(&mut self, question: &Question, now_s: f64, took_s: f64, since_missed_s: f64) {
        let ids = &question.targets;
        self.each_s = took_s / ids.len().max(1) as f64;
        self.rest_until_s = f64::NEG_INFINITY;
        // Beside no tracker a search is faster, which tells nothing of the device.
        if !self.follows_some() {
            return;
        }
        let denying = |id: &&TargetId| self.targets.get(id).is_some_and(|searched| searched.can_deny);
        let networks = ids.iter().filter(denying).count();
        let kind = (question.only_confirms, networks, ids.len() - networks);
        let fastest_s = self.fastest_s.entry(kind).or_insert(took_s);
        *fastest_s = took_s.min(*fastest_s);
        self.slowness.push_back(took_s / fastest_s.max(MIN_TIMED_S));
        if self.slowness.len() > SLOW_SEARCHES {
            self.slowness.pop_front();
        }
        let slowness = match self.slowness.len() {
            SLOW_SEARCHES => self.slowness.iter().copied().fold(f64::INFINITY, f64::min),
            _ => 1.0,
        };
        let late = if since_missed_s < BUSY_S { REST } else { 0.0 };
        let slow = if slowness >= SLOWED { slowness - 1.0 } else { 0.0 };
        self.rest_until_s = now_s + (late.max(slow) * took_s).min(CONFIRM_S);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEVER: f64 = f64::INFINITY;

    fn question<const N: usize>(targets: [TargetId; N], only_confirms: bool) -> Question {
        let targets = targets.to_vec();
        Question { targets, only_confirms }
    }

    /// A plan for targets that have a network of their own or not.
    fn plan_for<const N: usize>(can_deny: [bool; N]) -> SearchPlan {
        let mut plan = SearchPlan::default();
        (0..).zip(can_deny).for_each(|(id, can_deny)| plan.add(id, can_deny));
        plan
    }

    /// What is looked for now, and is asked for.
    fn ask(plan: &mut SearchPlan, now_s: f64) -> Vec<TargetId> {
        let ids = plan.next(now_s);
        plan.asked(&ids, now_s);
        ids
    }

    #[test]
    fn missing_targets_are_looked_for_in_turn_as_many_at_once_as_there_is_time_for() {
        let mut plan = plan_for([false; 3]);
        assert_eq!(ask(&mut plan, 0.0), [0, 1, 2]);
        plan.took(&question([0, 1, 2], false), 0.6, 0.6, NEVER);
        let asked: Vec<_> = (1..5).map(|s| ask(&mut plan, f64::from(s))).collect();
        assert_eq!(asked, [[0], [1], [2], [0]]);
        plan.took(&question([2], false), 4.5, 0.09, NEVER);
        assert_eq!(ask(&mut plan, 5.0), [1, 2, 0]);
        plan.remove(1);
        assert_eq!(ask(&mut plan, 6.0), [0, 2]);
        // In another video, whose clock begins anew, too.
        plan.took(&question([0, 2], false), 6.6, 0.6, NEVER);
        plan.restart();
        assert_eq!([0.0, 1.0, 2.0].map(|s| ask(&mut plan, s)), [[0], [2], [0]]);
    }

    #[test]
    fn what_is_followed_well_is_confirmed_every_two_seconds_and_what_is_not_at_once() {
        let mut plan = plan_for([false; 2]);
        ask(&mut plan, 0.0);
        plan.took(&question([0, 1], false), 0.6, 0.6, NEVER);
        plan.tracked(0, Some(0.9));
        assert!(plan.follows_some() && plan.misses_some());
        assert_eq!(ask(&mut plan, 0.7), [1]);
        assert_eq!(ask(&mut plan, 2.0), [1, 0]);
        plan.tracked(1, Some(0.9));
        assert!(ask(&mut plan, 2.1).is_empty());
        plan.tracked(0, Some(0.5));
        assert_eq!(ask(&mut plan, 2.2), [0]);
    }

    #[test]
    fn a_network_looks_at_every_frame_it_can_unless_something_else_is_missing() {
        let mut plan = plan_for([true, false]);
        ask(&mut plan, 0.0);
        plan.tracked(0, Some(0.9));
        plan.tracked(1, Some(0.9));
        assert!(plan.only_confirms(&[0]) && !plan.only_confirms(&[0, 1]));
        assert_eq!([0.1, 0.2].map(|s| ask(&mut plan, s)), [[0], [0]]);
        plan.tracked(1, None);
        assert_eq!([0.3, 2.3].map(|s| ask(&mut plan, s)), [vec![1], vec![1, 0]]);
    }

    /// Seconds for which the finders rest after searches that took so long.
    fn rest(plan: &mut SearchPlan, searches: &[f64], since_missed_s: f64) -> f64 {
        searches
            .iter()
            .for_each(|s| plan.took(&question([0], true), 0.0, *s, since_missed_s));
        plan.rest_until_s.max(0.0)
    }

    fn following() -> SearchPlan {
        let mut plan = plan_for([true]);
        plan.tracked(0, Some(0.9));
        plan
    }

    #[test]
    fn the_finders_rest_only_where_frames_are_missed_as_long_as_the_device_is_as_fast_as_ever() {
        let mut plan = following();
        assert_eq!(rest(&mut plan, &[0.1, 0.15, 0.12, 0.19], NEVER), 0.0);
        assert_eq!(rest(&mut plan, &[0.15], 2.0), 0.0);
        assert!((rest(&mut plan, &[0.15], 1.9) - 0.18).abs() < 1e-12);
        assert!(plan.next(0.17).is_empty() && plan.next(0.19) == [0]);
        plan.tracked(0, None);
        assert_eq!(plan.next(0.17), [0], "what is lost is looked for at once");
    }

    #[test]
    fn on_a_device_that_has_become_slower_they_rest_so_much_longer_until_it_is_fast_again() {
        let mut plan = following();
        assert_eq!(
            rest(&mut plan, &[0.1, 0.4, 0.4], NEVER),
            0.0,
            "two slow searches may be chance"
        );
        let quarter = rest(&mut plan, &[0.4], NEVER);
        assert!(
            (quarter - 1.2).abs() < 1e-12,
            "at work for a quarter of the time, not {quarter}"
        );
        // Not longer than a target goes unconfirmed.
        assert_eq!(rest(&mut plan, &[0.5, 2.0], NEVER), 2.0);
        assert_eq!(rest(&mut plan, &[0.11], NEVER), 0.0);
    }

    #[test]
    fn searches_are_compared_with_their_own_kind_and_only_beside_the_tracker() {
        let mut plan = following();
        rest(&mut plan, &[0.1; 3], NEVER);
        (0..3).for_each(|_| plan.took(&question([0], false), 0.0, 0.4, NEVER));
        assert_eq!(
            plan.rest_until_s.max(0.0),
            0.0,
            "those with features take longer anyway"
        );
        let mut alone = plan_for([true]);
        rest(&mut alone, &[0.03; 3], NEVER);
        alone.tracked(0, Some(0.9));
        assert_eq!(rest(&mut alone, &[0.1; 3], NEVER), 0.0);
    }
}
