import assert from "node:assert/strict";
import { test } from "node:test";

import { Presence } from "../../src/tracking/presence.js";
import { SearchPlan } from "../../src/tracking/search-plan.js";

/** What changes over frames with these correlations, 50 ms apart unless told. */
function changes(correlations, stepMs = 50) {
  const presence = new Presence();
  return correlations.map((correlation, i) => presence.update(correlation, i * stepMs));
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
  const states = [0.9, 0, 0.5].map((correlation, i) => (presence.update(correlation, i), [presence.isFound, presence.isConfirmed]));
  assert.deepEqual(states, [[true, true], [true, false], [true, true]]);
});

const targets = (...kinds) => kinds.map((kind, id) => ({ id, kind }));

test("missing targets are looked for in turn, as many at once as there is time for", () => {
  const plan = new SearchPlan(targets("picture", "picture", "picture"));
  assert.deepEqual(plan.next(0), [0, 1, 2]);
  plan.took([0, 1, 2], 600);
  assert.deepEqual([1000, 2000, 3000, 4000].map((ms) => plan.next(ms)), [[0], [1], [2], [0]]);
  plan.took([2], 100);
  assert.deepEqual(plan.next(5000), [1, 2, 0]);
  plan.remove(1);
  assert.deepEqual(plan.next(6000), [0, 2]);
});

test("what is followed well is confirmed every two seconds, what is not at once", () => {
  const plan = new SearchPlan(targets("picture", "picture"));
  assert.deepEqual(plan.next(0), [0, 1]);
  plan.took([0, 1], 600);
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

/** A plan that follows its target, after searches that took so long. */
function following(...searches) {
  const plan = new SearchPlan(targets("model"));
  plan.tracked(0, true, 0.9);
  for (const ms of searches) plan.took([0], ms, true);
  return plan;
}

test("the finders rest only where the tracker misses frames, as long as the device is as fast as ever", () => {
  const plan = following(100, 150, 120, 190);
  assert.equal(plan.restMs(200, false), 0);
  assert.equal(plan.restMs(200, true), 240);
  plan.tracked(0, false, 0);
  assert.equal(plan.restMs(200, true), 0, "what is lost is looked for at once");
});

test("on a device that has become several times slower they rest so much longer, until it is fast again", () => {
  const plan = following(100, 400, 400);
  assert.equal(plan.restMs(400, false), 0, "two slow searches may be chance");
  plan.took([0], 400, true);
  assert.equal(plan.restMs(400, false), 1200, "at work for a quarter of the time");
  assert.equal(plan.restMs(400, true), 1200);
  plan.took([0], 500, true);
  plan.took([0], 2000, true);
  assert.equal(plan.restMs(2000, false), 2000, "but not longer than a target goes unconfirmed");
  plan.took([0], 110, true);
  assert.equal(plan.restMs(110, false), 0);
});

test("searches are compared with their own kind, and only beside the tracker", () => {
  const plan = following(100, 100, 100);
  for (let i = 0; i < 3; i++) plan.took([0], 400, false);
  assert.equal(plan.restMs(400, false), 0, "those with features take longer anyway");
  const alone = new SearchPlan(targets("model"));
  for (let i = 0; i < 3; i++) alone.took([0], 30);
  alone.tracked(0, true, 0.9);
  for (let i = 0; i < 3; i++) alone.took([0], 100);
  assert.equal(alone.restMs(100, false), 0);
});
