// The demo page: a start screen, the person's own picture, the live view, and what to say when something is in the way.

import { CameraStream, openCamera } from "deepsft";
import { CameraSwitch, rememberedCamera } from "./live/camera-switch.js";
import { prefersStillness } from "./graphics/animation.js";
import { Hud } from "./live/hud.js";
import { keepAwake } from "./live/keep-awake.js";
import { ShotButtons } from "./live/shot-buttons.js";
import { messageFor } from "./messages.js";
import { workOffline } from "./offline/offline.js";
import { droppedFiles, onChosen } from "./own/given-files.js";
import { OwnPicture, scanAmong } from "./own/own-picture.js";
import { part } from "./part.js";
import { clipSource } from "./sources.js";
import { Subjects } from "./subjects.js";

/** @import { LoadProgress } from "deepsft" */
/** @import { Remedy } from "./messages.js" */
/** @import { Live } from "./live/live.js" */
/** @import { Choice } from "./live/overlays.js" */

/** What the buttons beside a message say and do. @type {Record<Remedy, [words: string, act: () => void]>} */
const REMEDIES = {
  retry: ["Try again", () => retry()],
  clip: ["Use the clip", startClip],
  image: ["Open an image", () => view.imageFile.click()],
  reload: ["Reload", () => location.reload()],
  picture: ["Choose another picture", () => part("#picture-file").click()],
  edit: ["Change this one", () => own.edit()],
  scan: ["Choose another scan", () => part("#scan-file").click()],
};
const TITLES = { start: document.title, own: "Your own picture – DeepSfT", live: "Live – DeepSfT" };
/** What has the focus first in each view. */
const FOCUSED = { start: "#choose-picture", own: "#own", live: "#back" };
const STAGE_WORDS = "The picture with what was found drawn over it";
const SOURCE_WORDS = { camera: "Camera", clip: "Clip, synthetic", image: "Image" };

const view = {
  live: part("#live"),
  hero: part("#hero", HTMLVideoElement),
  video: part("#video", HTMLVideoElement),
  loading: part("#loading"),
  loadingText: part("#loading-text"),
  loadingBar: part("#loading-bar", HTMLProgressElement),
  message: part("#message", HTMLDialogElement),
  stage: part("#stage"),
  imageFile: part("#image-file", HTMLInputElement),
};

const hud = new Hud();
const takeNewVersion = workOffline();
const shots = new ShotButtons(() => live?.view ?? null, (error) =>
  say(`This could not be kept: ${error instanceof Error ? error.message : error}`),
);
const cameras = new CameraSwitch(
  (name) => (part("#source-label").textContent = name || SOURCE_WORDS.camera),
  (error, name) => say(`${name} does not open. ${error instanceof Error ? error.message : error}`),
);
/** @type {Live | null} */
let live = null;
/** What is drawn over the picture: the values of the radio buttons by their names. */
const choice = /** @type {Choice} */ ({});
const subjects = new Subjects(showProgress, () => showWaiting("Learning the picture"));
/** The camera that shows. @type {CameraStream | null} */
let stream = null;
/** Ends what was started last, with its camera or clip. */
let leaving = new AbortController();
/** The end of the address that shows the clip at once. */
const CLIP_HASH = "#clip";
/** What is begun at once where the address ends so. @type {Readonly<Record<string, string>>} */
const AT_ONCE = { [CLIP_HASH]: "#use-clip", "#poster": "#use-camera" };
/** Whether the page is on its way back in the browser's history. */
let isReturning = false;
/** @type {() => void} what "Try again" does */
let retry = () => undefined;

const own = new OwnPicture({
  show: () => showView("own"),
  leave,
  use(picture, use) {
    subjects.chosen = picture;
    if (use === "image") view.imageFile.click();
    else startVideo("camera");
  },
  readScan: (files) => subjects.readScan(files),
  fail: showMessage,
});

/** @param {"start" | "own" | "live"} name */
function showView(name) {
  leaveLive();
  view.message.close();
  const before = document.body.dataset.view;
  document.body.dataset.view = name;
  view.live.hidden = name !== "live";
  part("#own").hidden = name !== "own";
  document.title = TITLES[name];
  if (name !== "own") own.close();
  if (name === "start" && !prefersStillness()) view.hero.play().catch(() => undefined);
  else view.hero.pause();
  takeNewVersion();
  if (name !== "start" && history.state) history.replaceState(history.state, "", addressOf(name));
  if (before === undefined || before === name) return;
  // What had the focus is gone, or goes.
  part(FOCUSED[name]).focus({ preventScroll: true });
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
  showView("start");
}

/** @param {LoadProgress} progress */
function showProgress({ phase, loadedBytes, totalBytes }) {
  const megabytes = (/** @type {number} */ bytes) => (bytes / 1e6).toFixed(1);
  if (phase === "start") return showWaiting(subjects.kind === "picture" ? "Starting the engine" : "Starting the network");
  const what = phase === "engine" ? "engine" : "model";
  const words = `Fetching the ${what}`;
  // What is the same is not read out again.
  if (view.loadingText.textContent !== words) view.loadingText.textContent = words;
  part("#loading-figures").textContent = `· ${megabytes(loadedBytes)}${totalBytes ? ` of ${megabytes(totalBytes)}` : ""} MB`;
  if (totalBytes) view.loadingBar.value = loadedBytes / totalBytes;
  else view.loadingBar.removeAttribute("value");
}

/** @param {string} words */
function showWaiting(words) {
  view.loadingText.textContent = words;
  part("#loading-figures").textContent = "";
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
  const { sft: { info: { fallback } }, target } = subject;
  // Pictures need no GPU: what runs without one then is nothing to speak of.
  if (subject.kind === "picture") say(target.grade?.reasons.join(" ") ?? "");
  else say(fallback ? `Running on the CPU. ${fallback.message}` : "");
  return subject;
}

/** @param {string} words shown over the picture until closed; empty for none */
function say(words) {
  part("#notice").hidden = words === "";
  part("#notice-text").textContent = words;
}

/**
 * Opens the live view and runs `run` in it; what it throws is shown.
 *
 * @param {keyof typeof SOURCE_WORDS} kind
 * @param {(signal: AbortSignal) => Promise<void>} run ends with the signal
 */
async function enterLive(kind, run) {
  retry = () => void enterLive(kind, run);
  part("#source-label").textContent = SOURCE_WORDS[kind];
  view.loading.hidden = false;
  view.loadingText.textContent = kind === "camera" ? "Asking for the camera" : "Starting";
  Object.assign(view.live.dataset, { source: kind, subject: subjects.kind });
  hud.reset();
  showView("live");
  const { signal } = (leaving = new AbortController());
  try {
    await run(signal);
  } catch (error) {
    if (!signal.aborted) showMessage(error);
  }
}

/** The live view. It is fetched, with three.js, when it is first wanted. */
async function liveView() {
  const { Live } = await import("./live/live.js");
  live ??= new Live(hud, choice, () => (view.loading.hidden = stream?.interrupted !== true));
  return live;
}

/** @param {"camera" | "clip"} kind */
function startVideo(kind) {
  void enterLive(kind, async (signal) => {
    // Side by side: the model loads while the person answers the camera's question.
    const subject = readySubject(signal);
    subject.catch(() => undefined);
    const viewing = liveView();
    viewing.catch(() => undefined);
    const opened = kind === "clip" ? await clipSource(view.video, signal) : { source: await openCamera(view.video, { ...rememberedCamera(), signal }) };
    signal.throwIfAborted();
    keepAwake(signal);
    if (opened.source instanceof CameraStream) watch(opened.source, signal);
    const ready = await subject;
    signal.throwIfAborted();
    showWaiting("Looking at the first frame");
    const shown = await viewing;
    signal.throwIfAborted();
    await shown.show(ready, opened, signal);
  });
}

/**
 * Says what becomes of a camera.
 *
 * @param {CameraStream} camera
 * @param {AbortSignal} signal
 */
function watch(camera, signal) {
  stream = camera;
  void cameras.use(camera);
  if (camera.error) throw camera.error;
  const interrupted = () => {
    showWaiting("The camera is interrupted");
    view.loading.hidden = false;
  };
  if (camera.interrupted) interrupted();
  camera.addEventListener("lost", () => showMessage(camera.error), { signal });
  camera.addEventListener("interrupted", interrupted, { signal });
  camera.addEventListener("resumed", () => (view.loadingText.textContent = "Looking at the next frame"), { signal });
}

function startClip() {
  subjects.chooseClip();
  startVideo("clip");
}

/** @param {Blob} photograph */
function startImage(photograph) {
  void enterLive("image", async (signal) => {
    const ready = await readySubject(signal);
    showWaiting("Looking at the image");
    await (await liveView()).show(ready, { photograph }, signal);
  });
}

function leaveLive() {
  shots.stop();
  leaving.abort();
  void cameras.use(null);
  stream = null;
}

/**
 * @param {unknown} error
 * @param {() => void} [again] what "Try again" does, if not what was tried last in the live view
 */
function showMessage(error, again) {
  leaveLive();
  hud.showWaiting("Stopped");
  retry = again ?? retry;
  const { title, advice, remedies, code, detail } = messageFor(error, document.body.dataset.view === "own" || subjects.isOwn);
  part("#message-title").textContent = title;
  part("#message-advice").textContent = advice;
  part("#message-code").textContent = code;
  part("#message-detail").textContent = detail;
  const buttons = remedies.map((remedy, i) => {
    const [textContent, onclick] = REMEDIES[remedy];
    return Object.assign(document.createElement("button"), { type: "button", textContent, onclick, className: i === 0 ? "primary" : "" });
  });
  part("#message-remedies").replaceChildren(...buttons);
  view.loading.hidden = true;
  if (!view.message.open) view.message.showModal();
  buttons[0]?.focus();
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
  part("#hud").hidden = !open;
  part("#hud-toggle").setAttribute("aria-expanded", String(open));
}

for (const [button, subject] of /** @type {const} */ ([["#use-camera", "poster"], ["#use-tube", "tube"]])) {
  part(button).addEventListener("click", () => {
    subjects.chosen = subject;
    startVideo("camera");
  });
}
part("#use-clip").addEventListener("click", startClip);
part("#use-screen").addEventListener("click", async () => (await import("./screen.js")).showOnScreen());
part("#use-image").addEventListener("click", () => {
  subjects.chosen = "poster";
  view.imageFile.click();
});
onChosen(view.imageFile, ([file]) => startImage(file));
for (const button of ["#back", "#message-close"]) part(button).addEventListener("click", leave);
view.message.addEventListener("cancel", leave);
addEventListener("popstate", () => {
  const isAway = document.body.dataset.view !== "start" && !history.state;
  // Who has come back and gone on meanwhile stays there.
  if (isAway && isReturning) history.pushState({ isView: true }, "");
  else if (isAway) leave();
  isReturning = false;
});
part("#notice-close").addEventListener("click", () => (part("#notice").hidden = true));
part(".controls").addEventListener("change", showChoice);
part("#hud-toggle").addEventListener("click", () => openHud(part("#hud").hidden !== false));
part("#forget").addEventListener("click", () => stream?.calibrate(view.video.videoWidth, view.video.videoHeight, null));
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => {
  event.preventDefault();
  void droppedFiles(event.dataTransfer).then(takeFiles);
});
addEventListener("paste", ({ clipboardData }) => takeFiles(clipboardData?.files));

/** @param {Iterable<File>} [given] a scan; a photograph to look at while something is looked for; else the person's own picture */
function takeFiles(given = []) {
  const files = [...given];
  if (files.length === 0) return;
  if (scanAmong(files)) void own.readScan(files);
  else if (document.body.dataset.view === "live") startImage(files[0]);
  else void own.read(files[0]);
}

showChoice();
openHud(matchMedia("(min-width: 760px) and (min-height: 560px)").matches);
showView("start");
const atOnce = AT_ONCE[location.hash];
if (atOnce) {
  history.replaceState(null, "", addressOf("start"));
  part(atOnce).click();
}
