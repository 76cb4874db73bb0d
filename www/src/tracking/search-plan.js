// Which targets the finders look for in a frame.

/** @import { Target } from "../targets/target.js" */

/** Agreement from which a followed target needs no finder soon. */
const SURE = 0.6;
/** After so long it is looked for all the same, milliseconds: a track may sit in a wrong fold. */
const CONFIRM_MS = 2000;
/** What one search of missing targets should take at most, milliseconds; one target is looked for in any case. */
const BUDGET_MS = 300;

/** @typedef {{ target: Target, isFollowed: boolean, agreement: number, askedAt: number }} Searched */

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

  /** @param {Target[]} targets */
  constructor(targets) {
    this.#targets = new Map(
      targets.map((target) => [target.id, { target, isFollowed: false, agreement: 0, askedAt: -Infinity }]),
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
      return searched?.isFollowed && searched.agreement >= SURE && searched.target.kind === "model";
    });
  }

  /**
   * What the tracker says of a target in its newest frame.
   *
   * @param {number} id
   * @param {boolean} isFollowed
   * @param {number} agreement
   * @returns {boolean} whether the target was just lost
   */
  tracked(id, isFollowed, agreement) {
    const searched = this.#targets.get(id);
    if (!searched) return false;
    const isLost = searched.isFollowed && !isFollowed;
    [searched.isFollowed, searched.agreement] = [isFollowed, agreement];
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
    const due = inTurn.filter(({ isFollowed, agreement, askedAt, target }) => {
      if (!isFollowed) return false;
      const isSure = agreement >= SURE && (target.kind !== "model" || missing.length > 0);
      return !isSure || nowMs - askedAt >= CONFIRM_MS;
    });
    const atOnce = Math.max(1, Math.floor(BUDGET_MS / Math.max(this.#eachMs, 1)));
    const chosen = [...missing.slice(0, atOnce), ...due.slice(0, 1)];
    for (const searched of chosen) searched.askedAt = nowMs;
    return chosen.map(({ target }) => target.id);
  }

  /**
   * @param {number} count of targets that a search was for
   * @param {number} ms that it took
   */
  took(count, ms) {
    this.#eachMs = ms / Math.max(count, 1);
  }
}
