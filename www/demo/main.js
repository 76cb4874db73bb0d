// The demo page: a start screen, the person's own picture, the live view, and what to say when something is in the way.

import { CameraSwitch } from "./live/camera-switch.js";
import { prefersStillness } from "./graphics/animation.js";
import { Hud } from "./live/hud.js";
import { KeepAwake } from "./live/keep-awake.js";
import { MeasuresPanel } from "./live/measures.js";
import { ShotButtons } from "./live/shot-buttons.js";
import { messageFor } from "./messages.js";
import { workOffline } from "./offline/offline.js";
import { OwnPicture, scanAmong } from "./own/own-picture.js";
import { cameraSource, clipSource } from "./sources.js";
import { Subjects } from "./subjects.js";

/** @import { CameraStream, LoadProgress } from "deepsft" */
/** @import { Remedy } from "./messages.js" */
/** @import { VideoSource } from "./sources.js" */
/** @import { Orbit } from "./graphics/orbit.js" */
/** @import { Live } from "./live/live.js" */
/** @import { Choice } from "./live/overlays.js" */

/** @type {Record<Remedy, string>} */
const REMEDY_WORDS = {
  retry: "Try again",
  camera: "Use the camera",
  clip: "Use the clip",
  image: "Open an image",
  reload: "Reload",
  picture: "Choose another picture",
  edit: "Change this one",
  scan: "Choose another scan",
};
/** What the arrow keys move the object by, of the print's sides. @type {Readonly<Record<string, [number, number]>>} */
const OBJECT_STEPS = { ArrowLeft: [-0.04, 0], ArrowRight: [0.04, 0], ArrowUp: [0, -0.04], ArrowDown: [0, 0.04] };
const TITLES = { start: document.title, own: "Your own picture – DeepSfT", live: "Live – DeepSfT" };
/** What has the focus first in each view. */
const FOCUSED = { start: "choose-picture", own: "own", live: "back" };
const STAGE_WORDS = "The picture with what was found drawn over it";
const SOURCE_WORDS = { camera: "Camera", clip: "Clip, synthetic", image: "Image" };

/**
 * What a library that grades pictures says of one: how well it can be found, and sentences that help.
 *
 * @typedef {{ grade?: { level: string, reasons: string[] } }} Graded
 */

/** @template {HTMLElement} T @param {string} id @param {new () => T} kind @returns {T} */
function byId(id, kind) {
  const found = document.getElementById(id);
  if (!(found instanceof kind)) throw new Error(`The page has no ${id}.`);
  return found;
}

const view = {
  live: byId("live", HTMLDivElement),
  own: byId("own", HTMLDivElement),
  hero: byId("hero", HTMLVideoElement),
  video: byId("video", HTMLVideoElement),
  loading: byId("loading", HTMLElement),
  loadingText: byId("loading-text", HTMLSpanElement),
  loadingFigures: byId("loading-figures", HTMLSpanElement),
  loadingBar: byId("loading-bar", HTMLProgressElement),
  message: byId("message", HTMLDialogElement),
  notice: byId("notice", HTMLDivElement),
  stage: byId("stage", HTMLDivElement),
  forget: byId("forget", HTMLButtonElement),
  hudToggle: byId("hud-toggle", HTMLButtonElement),
  imageFile: byId("image-file", HTMLInputElement),
};

const hud = new Hud();
const takeNewVersion = workOffline();
const measures = new MeasuresPanel(byId("measures", HTMLParagraphElement), byId("measures-said", HTMLParagraphElement));
const shots = new ShotButtons(byId("shots", HTMLDivElement), () => live?.view ?? null, (error) =>
  say(`This could not be kept: ${error instanceof Error ? error.message : error}`),
);
const cameras = new CameraSwitch(
  byId("cameras", HTMLDivElement),
  (name) => (byId("source-label", HTMLParagraphElement).textContent = name || SOURCE_WORDS.camera),
  (error, name) => say(`${name} does not open. ${error instanceof Error ? error.message : error}`),
);
const awake = new KeepAwake();
/** @type {Live | null} */
let live = null;
/** What is drawn over the picture: the values of the radio buttons by their names. */
const choice = /** @type {Choice} */ ({});
const subjects = new Subjects(showProgress, () => showWaiting("Learning your picture"));
/** @type {VideoSource | null} */
let source = null;
/** Ends what was started last, with its camera or clip. */
let leaving = new AbortController();
/** The end of the address that shows the clip at once. */
const CLIP_HASH = "#clip";
/** Whether the page is on its way back in the browser's history. */
let isReturning = false;
/** @type {() => void} what "Try again" does */
let retry = () => undefined;

const own = new OwnPicture(view.own, {
  show() {
    leaveLive();
    closeMessage();
    showView("own");
  },
  leave: () => showView("start"),
  use(picture, use) {
    subjects.choose(picture);
    if (use === "image") view.imageFile.click();
    else startVideo("camera", cameraSource);
  },
  readScan: (files) => subjects.readScan(files),
  fail: (error) => showMessage(error, () => own.retry()),
});

/** @param {"start" | "own" | "live"} name */
function showView(name) {
  const before = document.body.dataset.view;
  document.body.dataset.view = name;
  view.live.hidden = name !== "live";
  view.own.hidden = name !== "own";
  document.title = TITLES[name];
  if (name !== "own") own.close();
  if (name === "start" && !prefersStillness()) view.hero.play().catch(() => undefined);
  else view.hero.pause();
  takeNewVersion();
  if (name !== "start" && history.state) history.replaceState(history.state, "", addressOf(name));
  if (before === undefined || before === name) return;
  // What had the focus is gone, or goes.
  byId(FOCUSED[name], HTMLElement).focus({ preventScroll: true });
  // The browser's way back leads to the start, like the page's own.
  if (name !== "start" && !history.state) history.pushState({ isView: true }, "", addressOf(name));
  if (name !== "start" || !history.state || isReturning) return;
  isReturning = true;
  history.back();
}

/**
 * The address of a view. Of all that is shown the clip alone needs nothing of the person, so it alone can be sent to others.
 *
 * @param {"start" | "own" | "live"} name
 */
function addressOf(name) {
  const hash = name === "live" && view.live.dataset.source === "clip" ? CLIP_HASH : "";
  return `${location.pathname}${location.search}${hash}`;
}

/** Back to the start screen. */
function leave() {
  leaveLive();
  closeMessage();
  showView("start");
}

function closeMessage() {
  view.message.close();
}

/** @param {LoadProgress} progress */
function showProgress({ phase, loadedBytes, totalBytes }) {
  const megabytes = (/** @type {number} */ bytes) => (bytes / 1e6).toFixed(1);
  if (phase === "start") return showWaiting(subjects.kind === "picture" ? "Starting the engine" : "Starting the network");
  const what = phase === "engine" ? "engine" : "model";
  const words = `Fetching the ${what}`;
  // What is the same is not read out again.
  if (view.loadingText.textContent !== words) view.loadingText.textContent = words;
  view.loadingFigures.textContent = `· ${megabytes(loadedBytes)}${totalBytes ? ` of ${megabytes(totalBytes)}` : ""} MB`;
  if (totalBytes) view.loadingBar.value = loadedBytes / totalBytes;
  else view.loadingBar.removeAttribute("value");
}

/** @param {string} words */
function showWaiting(words) {
  view.loadingText.textContent = words;
  view.loadingFigures.textContent = "";
  view.loadingBar.removeAttribute("value");
}

/**
 * What is looked for, ready to be looked for.
 *
 * @param {AbortSignal} signal
 */
async function readySubject(signal) {
  const subject = await subjects.ready();
  signal.throwIfAborted();
  const { fallback } = subject.sft.info;
  const { grade } = /** @type {Graded} */ (subject.target);
  // Pictures need no GPU: what runs without one then is nothing to speak of.
  if (subject.kind === "picture") say(...(grade?.reasons ?? []));
  else say(...(fallback ? [`Running on the CPU. ${fallback.message}`] : []));
  return subject;
}

/** @param {string[]} sentences shown over the picture until closed */
function say(...sentences) {
  const words = sentences.join(" ");
  view.notice.hidden = words === "";
  byId("notice-text", HTMLSpanElement).textContent = words;
}

/**
 * Opens the live view and runs `run` in it; what it throws is shown.
 *
 * @param {keyof typeof SOURCE_WORDS} kind
 * @param {(signal: AbortSignal) => Promise<void>} run ends with the signal
 */
async function enterLive(kind, run) {
  leaveLive();
  const { signal } = (leaving = new AbortController());
  retry = () => void enterLive(kind, run);
  closeMessage();
  byId("source-label", HTMLParagraphElement).textContent = SOURCE_WORDS[kind];
  view.loading.hidden = false;
  view.loadingText.textContent = kind === "camera" ? "Asking for the camera" : "Starting";
  view.live.dataset.source = kind;
  view.live.dataset.subject = subjects.kind;
  hud.reset();
  showView("live");
  try {
    await run(signal);
  } catch (error) {
    if (!signal.aborted) showMessage(error);
  }
}

/** The live view. It is fetched, with three.js, when it is first wanted. */
async function liveView() {
  if (live) return live;
  const [{ Live }, orbit] = await Promise.all([import("./live/live.js"), createOrbit()]);
  if (live) return live;
  live = new Live(view.stage, hud, orbit, byId("region", HTMLDivElement), choice);
  const shown = () => (view.loading.hidden = source?.stream?.interrupted !== true);
  live.onEstimate = shown;
  live.onMesh = (mesh, camera, atOnce) => measures.show(mesh, camera, atOnce, subjects.tells);
  live.onFrame = () => subjects.kind === "picture" && shown();
  return live;
}

/** The sheet from the side. @returns {Promise<Orbit | null>} null where the browser offers no WebGL 2 */
async function createOrbit() {
  const { Orbit } = await import("./graphics/orbit.js");
  const canvas = byId("orbit", HTMLCanvasElement);
  try {
    return new Orbit(canvas);
  } catch {
    canvas.hidden = true;
    return null;
  }
}

/**
 * @param {"camera" | "clip"} kind
 * @param {(video: HTMLVideoElement, signal: AbortSignal) => Promise<VideoSource>} open
 */
function startVideo(kind, open) {
  void enterLive(kind, async (signal) => {
    // Side by side: the model loads while the person answers the camera's question.
    const subject = readySubject(signal);
    subject.catch(() => undefined);
    const viewing = liveView();
    viewing.catch(() => undefined);
    const opened = await open(view.video, signal);
    signal.throwIfAborted();
    source = opened;
    if (opened.stream) watch(opened.stream, signal);
    void cameras.use(opened.stream);
    awake.keep(true);
    if (opened.stream?.error) throw opened.stream.error;
    const ready = await subject;
    signal.throwIfAborted();
    showWaiting("Looking at the first frame");
    const shown = await viewing;
    signal.throwIfAborted();
    await shown.follow(ready, view.video, opened, signal);
  });
}

/**
 * Says what becomes of a camera.
 *
 * @param {CameraStream} stream
 * @param {AbortSignal} signal
 */
function watch(stream, signal) {
  const interrupted = () => {
    showWaiting("The camera is interrupted");
    view.loading.hidden = false;
  };
  if (stream.interrupted) interrupted();
  stream.addEventListener("lost", () => showMessage(stream.error), { signal });
  stream.addEventListener("interrupted", interrupted, { signal });
  stream.addEventListener("resumed", () => (view.loadingText.textContent = "Looking at the next frame"), { signal });
}

/** The clip shows the poster. */
function startClip() {
  subjects.choose("poster");
  startVideo("clip", clipSource);
}

/** @param {Blob} image */
function startImage(image) {
  void enterLive("image", async (signal) => {
    const ready = await readySubject(signal);
    showWaiting("Looking at the image");
    await (await liveView()).show(ready, image, signal);
  });
}

function leaveLive() {
  shots.stop();
  leaving.abort();
  measures.reset();
  void cameras.use(null);
  awake.keep(false);
  source = null;
}

/**
 * @param {unknown} error
 * @param {() => void} [again] what "Try again" does, if not what was tried last in the live view
 */
function showMessage(error, again) {
  leaveLive();
  hud.showStopped();
  retry = again ?? retry;
  const { title, advice, remedies, code, detail } = messageFor(error, document.body.dataset.view === "own" || subjects.kind === "picture");
  byId("message-title", HTMLHeadingElement).textContent = title;
  byId("message-advice", HTMLParagraphElement).textContent = advice;
  byId("message-code", HTMLElement).textContent = code;
  byId("message-detail", HTMLSpanElement).textContent = detail;
  const buttons = remedies.map((remedy, i) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = REMEDY_WORDS[remedy];
    button.classList.toggle("primary", i === 0);
    button.addEventListener("click", () => applyRemedy(remedy));
    return button;
  });
  byId("message-remedies", HTMLDivElement).replaceChildren(...buttons);
  view.loading.hidden = true;
  if (!view.message.open) view.message.showModal();
  buttons[0]?.focus();
}

/** @param {Remedy} remedy */
function applyRemedy(remedy) {
  if (remedy === "retry") retry();
  else if (remedy === "camera") startVideo("camera", cameraSource);
  else if (remedy === "clip") startClip();
  else if (remedy === "image") view.imageFile.click();
  else if (remedy === "picture") own.choose();
  else if (remedy === "edit") own.edit();
  else if (remedy === "scan") own.chooseScan();
  else location.reload();
}

/** Shows what the radio buttons say. */
function showChoice() {
  for (const { name, value } of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll(".controls :checked"))) Object.assign(choice, { [name]: value });
  const isObject = choice.overlay === "object";
  // The object can be moved there.
  view.stage.tabIndex = isObject ? 0 : -1;
  view.stage.setAttribute("aria-label", isObject ? `${STAGE_WORDS}; tap the sheet, or press the arrow keys, to move the object` : STAGE_WORDS);
  view.live.dataset.overlay = choice.overlay;
  live?.refresh();
}

/** @param {boolean} open */
function openHud(open) {
  byId("hud", HTMLElement).hidden = !open;
  view.hudToggle.setAttribute("aria-expanded", String(open));
}

for (const [id, subject] of /** @type {const} */ ([["use-camera", "poster"], ["use-tube", "tube"]])) {
  byId(id, HTMLButtonElement).addEventListener("click", () => {
    subjects.choose(subject);
    startVideo("camera", cameraSource);
  });
}
byId("use-clip", HTMLButtonElement).addEventListener("click", startClip);
byId("use-image", HTMLButtonElement).addEventListener("click", () => {
  subjects.choose("poster");
  view.imageFile.click();
});
view.imageFile.addEventListener("change", () => {
  const [file] = view.imageFile.files ?? [];
  view.imageFile.value = "";
  if (file) startImage(file);
});
for (const id of ["back", "message-close"]) byId(id, HTMLButtonElement).addEventListener("click", leave);
view.message.addEventListener("cancel", leave);
addEventListener("popstate", () => {
  const isAway = document.body.dataset.view !== "start" && !history.state;
  // Who has come back and gone on meanwhile stays there.
  if (isAway && isReturning) history.pushState({ isView: true }, "");
  else if (isAway) leave();
  isReturning = false;
});
byId("notice-close", HTMLButtonElement).addEventListener("click", () => (view.notice.hidden = true));
document.querySelector(".controls")?.addEventListener("change", showChoice);
view.hudToggle.addEventListener("click", () => openHud(view.hudToggle.getAttribute("aria-expanded") !== "true"));
view.forget.addEventListener("click", () => {
  const { videoWidth, videoHeight } = view.video;
  source?.stream?.calibrate(videoWidth, videoHeight, null);
});
view.stage.addEventListener("click", ({ clientX, clientY }) => live?.placeObjectAt(clientX, clientY));
view.stage.addEventListener("keydown", (event) => {
  const step = OBJECT_STEPS[event.key];
  if (!step || choice.overlay !== "object") return;
  event.preventDefault();
  live?.moveObject(...step);
});
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => {
  event.preventDefault();
  takeFiles(event.dataTransfer?.files);
});
addEventListener("paste", (event) => {
  takeFiles(event.clipboardData?.files);
});

/** @param {FileList | undefined} files a scan; a photograph to look at while something is looked for; else the person's own picture */
function takeFiles(files) {
  const [file] = files ?? [];
  if (!file) return;
  if (scanAmong(files ?? [])) void own.readScan([...(files ?? [])]);
  else if (document.body.dataset.view === "live") startImage(file);
  else void own.read(file);
}

showChoice();
openHud(matchMedia("(min-width: 760px) and (min-height: 560px)").matches);
showView("start");
if (location.hash === CLIP_HASH) {
  history.replaceState(null, "", addressOf("start"));
  startClip();
}
