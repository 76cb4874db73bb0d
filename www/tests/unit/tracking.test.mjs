import assert from "node:assert/strict";
import { test } from "node:test";

import { Presence } from "../../src/tracking/presence.js";
import { SearchPlan } from "../../src/tracking/search-plan.js";

/** What changes over frames with these agreements, 50 ms apart unless told. */
function changes(agreements, stepMs = 50) {
  const presence = new Presence();
  return agreements.map((agreement, i) => presence.update(agreement, i * stepMs));
}

test("a target is found after three frames in a row, or at once by a strong one", () => {
  assert.deepEqual(changes([0, 0.4, 0.4, 0.4, 0.4]), [null, null, null, "found", null]);
  assert.deepEqual(changes([0.4, 0.4, 0.3, 0.4, 0.4, 0.5]), [null, null, null, null, null, "found"]);
  assert.deepEqual(changes([0, 0.8, 0.9]), [null, "found", null]);
});

test("it is lost when no frame has confirmed it for 0.4 seconds, and a shorter gap is nothing", () => {
  assert.deepEqual(changes([0.9, ...Array(7).fill(0), 0.4, ...Array(8).fill(0.1)]), ["found", ...Array(15).fill(null), "lost"]);
  // At five frames a second two in a row are lost.
  assert.deepEqual(changes([0.9, 0, 0, 0, 0.5], 200), ["found", null, "lost", null, null]);
});

test("a frame says whether it confirms", () => {
  const presence = new Presence();
  const states = [0.9, 0, 0.5].map((agreement, i) => (presence.update(agreement, i), [presence.isFound, presence.isConfirmed]));
  assert.deepEqual(states, [[true, true], [true, false], [true, true]]);
});

const targets = (...kinds) => kinds.map((kind, id) => ({ id, kind }));

test("missing targets are looked for in turn, as many at once as there is time for", () => {
  const plan = new SearchPlan(targets("picture", "picture", "picture"));
  assert.deepEqual(plan.next(0), [0, 1, 2]);
  plan.took(3, 600);
  assert.deepEqual([1000, 2000, 3000, 4000].map((ms) => plan.next(ms)), [[0], [1], [2], [0]]);
  plan.took(1, 100);
  assert.deepEqual(plan.next(5000), [1, 2, 0]);
  plan.remove(1);
  assert.deepEqual(plan.next(6000), [0, 2]);
});

test("what is followed well is confirmed every two seconds, what is not at once", () => {
  const plan = new SearchPlan(targets("picture", "picture"));
  assert.deepEqual(plan.next(0), [0, 1]);
  plan.took(2, 600);
  assert.equal(plan.tracked(0, true, 0.9), false);
  assert.deepEqual([plan.isMissingSome, plan.isFollowingSome], [true, true]);
  assert.deepEqual(plan.next(100), [1]);
  assert.deepEqual(plan.next(2000), [1, 0]);
  plan.tracked(1, true, 0.9);
  assert.deepEqual(plan.next(2100), []);
  plan.tracked(0, true, 0.5);
  assert.deepEqual(plan.next(2200), [0]);
  assert.equal(plan.tracked(0, false, 0), true);
  assert.equal(plan.tracked(0, false, 0), false);
  assert.equal(plan.tracked(7, false, 0), false);
});

test("the network of a model looks at every frame it can, unless something else is missing", () => {
  const plan = new SearchPlan(targets("model", "picture"));
  plan.next(0);
  plan.tracked(0, true, 0.9);
  plan.tracked(1, true, 0.9);
  assert.deepEqual([100, 200].map((ms) => plan.next(ms)), [[0], [0]]);
  plan.tracked(1, false, 0);
  assert.deepEqual([300, 2300].map((ms) => plan.next(ms)), [[1], [1, 0]]);
});
