// Which targets the finders look for in a frame.

/** @import { Target } from "../targets/target.js" */

/** Correlation from which a followed target needs no finder soon. */
const SURE = 0.6;
/** After so long it is looked for all the same, milliseconds: a track may sit in a wrong fold. */
const CONFIRM_MS = 2000;
/** What one search of missing targets should take at most, milliseconds; one target is looked for in any case. */
const BUDGET_MS = 300;

/**
 * How long the finders rest after an answer where the tracker misses frames beside them, in times of that answer, and at most,
 * milliseconds: the time after which a followed target is confirmed at the latest.
 */
const REST = 1.2;
const MAX_REST_MS = CONFIRM_MS;
/**
 * From so many times of the fastest search of the same kind on the device has become slow, as phones do when they get hot, if so many
 * searches in a row took so long.
 */
const SLOWED = 2;
const SLOW_SEARCHES = 3;

/** @typedef {{ target: Target, isFollowed: boolean, correlation: number, askedAt: number }} Searched */

/**
 * Spends the finders on the targets that are missing, in turn, as many at once as a search may take time for. A target that is
 * followed is confirmed now and then, at once when the image does not confirm it, and in between when nothing is missing and it
 * has a network, which also denies.
 */
export class SearchPlan {
  /** @type {Map<number, Searched>} */
  #targets;
  /** Of the last search, milliseconds per target. */
  #eachMs = 0;
  /** The fastest search of each kind while something was followed, milliseconds. @type {Map<string, number>} */
  #fastestMs = new Map();
  /** How many times as long as the fastest the last searches took. @type {number[]} */
  #slowness = [];

  /** @param {Target[]} targets */
  constructor(targets) {
    this.#targets = new Map(
      targets.map((target) => [target.id, { target, isFollowed: false, correlation: 0, askedAt: -Infinity }]),
    );
  }

  /** Whether some target is not followed. */
  get isMissingSome() {
    return [...this.#targets.values()].some(({ isFollowed }) => !isFollowed);
  }

  /** Whether some target is followed. */
  get isFollowingSome() {
    return [...this.#targets.values()].some(({ isFollowed }) => isFollowed);
  }

  /**
   * Whether a search only confirms: each target has a network and is followed well. The canonical image is enough for it; features,
   * which find what is missing, need more pixels.
   *
   * @param {number[]} ids
   */
  onlyConfirms(ids) {
    return ids.every((id) => {
      const searched = this.#targets.get(id);
      return searched?.isFollowed && searched.correlation >= SURE && searched.target.kind === "model";
    });
  }

  /**
   * What the tracker says of a target in its newest frame.
   *
   * @param {number} id
   * @param {boolean} isFollowed
   * @param {number} correlation
   * @returns {boolean} whether the target was just lost
   */
  tracked(id, isFollowed, correlation) {
    const searched = this.#targets.get(id);
    if (!searched) return false;
    const isLost = searched.isFollowed && !isFollowed;
    [searched.isFollowed, searched.correlation] = [isFollowed, correlation];
    return isLost;
  }

  /** @param {number} id of a target that is looked for no longer */
  remove(id) {
    this.#targets.delete(id);
  }

  /**
   * The targets to look for now, by number; none when all are followed well.
   *
   * @param {number} nowMs
   * @returns {number[]}
   */
  next(nowMs) {
    const inTurn = [...this.#targets.values()].sort((a, b) => a.askedAt - b.askedAt);
    const missing = inTurn.filter(({ isFollowed }) => !isFollowed);
    const due = inTurn.filter(({ isFollowed, correlation, askedAt, target }) => {
      if (!isFollowed) return false;
      const isSure = correlation >= SURE && (target.kind !== "model" || missing.length > 0);
      return !isSure || nowMs - askedAt >= CONFIRM_MS;
    });
    const atOnce = Math.max(1, Math.floor(BUDGET_MS / Math.max(this.#eachMs, 1)));
    const chosen = [...missing.slice(0, atOnce), ...due.slice(0, 1)];
    for (const searched of chosen) searched.askedAt = nowMs;
    return chosen.map(({ target }) => target.id);
  }

  /**
   * @param {number[]} ids of the targets that a search was for
   * @param {number} ms that it took
   * @param {boolean} [onlyConfirmed] whether it was one of {@link SearchPlan.onlyConfirms}
   */
  took(ids, ms, onlyConfirmed = false) {
    this.#eachMs = ms / Math.max(ids.length, 1);
    // Beside no tracker a search is faster, which tells nothing of the device.
    if (!this.isFollowingSome) return;
    const kind = `${onlyConfirmed} ${ids.map((id) => this.#targets.get(id)?.target.kind).sort()}`;
    const fastest = Math.min(ms, this.#fastestMs.get(kind) ?? Infinity);
    this.#fastestMs.set(kind, fastest);
    this.#slowness = [...this.#slowness.slice(1 - SLOW_SEARCHES), ms / Math.max(fastest, 1)];
  }

  /**
   * How long the finders rest now, milliseconds. They rest only while something is followed: what is followed they confirm, what is
   * missing everything waits for. A processor with too few cores for both serves the tracker first. On a device that has become
   * slow they work as small a part of the time as it has become slower: less heat, and the tracker keeps its rate.
   *
   * @param {number} ms that the last answer took, with what the tracker made of it
   * @param {boolean} isTrackerLate whether the tracker has missed frames of late
   */
  restMs(ms, isTrackerLate) {
    if (!this.isFollowingSome) return 0;
    const slowness = this.#slowness.length < SLOW_SEARCHES ? 1 : Math.min(...this.#slowness);
    const times = Math.max(isTrackerLate ? REST : 0, slowness >= SLOWED ? slowness - 1 : 0);
    return Math.min(MAX_REST_MS, times * ms);
  }
}
