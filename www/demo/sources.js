// The three places a picture can come from, each as a video or an image with its camera.

import { DeepSftError, openCamera } from "deepsft";
import { rememberedCamera } from "./live/camera-switch.js";

/** @import { Camera, CameraOption, CameraStream } from "deepsft" */

/**
 * @typedef {object} VideoSource
 * @property {"camera" | "clip"} kind
 * @property {CameraOption | undefined} camera
 * @property {CameraStream | null} stream of a real camera
 * @property {() => void} stop
 */

/** The clip in each coding, the one to prefer first. */
const CLIPS = [
  { url: "demo/clip.webm", type: 'video/webm; codecs="vp8"' },
  { url: "demo/clip.mp4", type: 'video/mp4; codecs="avc1.64001f"' },
];
const CLIP_CAMERA_URL = "demo/clip.json";

/**
 * @param {HTMLVideoElement} video
 * @returns {Promise<VideoSource>}
 */
export async function cameraSource(video) {
  const stream = await openCamera(video, rememberedCamera());
  return { kind: "camera", camera: undefined, stream, stop: () => stream.stop() };
}

/**
 * The bundled clip.
 *
 * @param {HTMLVideoElement} video
 * @returns {Promise<VideoSource>}
 */
export async function clipSource(video) {
  const description = fetched(CLIP_CAMERA_URL).then((response) => /** @type {Promise<{ camera: Camera }>} */ (response.json()));
  description.catch(() => undefined);
  const listening = new AbortController();
  // Phones pause videos while the page is away, and leave them so.
  const playOn = () => void (document.visibilityState === "visible" && video.play().catch(() => undefined));
  document.addEventListener("visibilitychange", playOn, { signal: listening.signal });
  addEventListener("pageshow", playOn, { signal: listening.signal });
  let release = () => {};
  const stop = () => {
    listening.abort();
    video.pause();
    video.removeAttribute("src");
    video.load();
    release();
  };
  video.muted = true;
  video.loop = true;
  try {
    release = await playFirst(video);
    const { camera } = await description;
    return { kind: "clip", camera, stream: null, stop };
  } catch (error) {
    stop();
    if (error instanceof DeepSftError) throw error;
    throw new DeepSftError("image-unreadable", "This browser cannot play the clip.", { cause: error });
  }
}

/**
 * Plays the first coding that the browser does play. It is fetched whole, so that it also loops from servers that cannot seek. Some
 * browsers play no video from memory (WebKit on Linux): they get the address.
 *
 * @param {HTMLVideoElement} video
 * @returns {Promise<() => void>} lets the memory go
 */
async function playFirst(video) {
  /** @type {unknown} */
  let refusal = new Error("It knows none of the clip's codings.");
  for (const { url, type } of CLIPS) {
    if (video.canPlayType(type) === "") continue;
    const whole = URL.createObjectURL(await fetched(url).then((response) => response.blob()));
    const release = () => URL.revokeObjectURL(whole);
    for (const address of [whole, url]) {
      video.src = address;
      try {
        await video.play();
        return release;
      } catch (error) {
        refusal = error;
        // Everything else is not about the file: the person has left, or nothing may play by itself.
        if (!(error instanceof DOMException && error.name === "NotSupportedError")) break;
      }
    }
    release();
    if (!(refusal instanceof DOMException && refusal.name === "NotSupportedError")) break;
  }
  throw refusal;
}

/** @param {string} url */
async function fetched(url) {
  const response = await fetch(url).catch(() => null);
  if (!response?.ok) throw new DeepSftError("image-unreadable", `${url} could not be fetched.`);
  return response;
}
