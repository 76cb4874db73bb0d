// The three places a picture can come from, each as a video or an image with its camera.

import { DeepSftError, openCamera } from "deepsft";

/** @import { Camera, CameraOption, CameraStream } from "deepsft" */

/**
 * @typedef {object} VideoSource
 * @property {"camera" | "clip"} kind
 * @property {CameraOption | undefined} camera
 * @property {CameraStream | null} stream of a real camera
 * @property {() => void} stop
 */

const CLIP_URL = "demo/clip.webm";
const CLIP_CAMERA_URL = "demo/clip.json";

/**
 * @param {HTMLVideoElement} video
 * @returns {Promise<VideoSource>}
 */
export async function cameraSource(video) {
  const stream = await openCamera(video);
  return { kind: "camera", camera: stream.intrinsics, stream, stop: () => stream.stop() };
}

/**
 * The bundled clip. It is fetched whole, so that it also loops from servers that cannot seek.
 *
 * @param {HTMLVideoElement} video
 * @returns {Promise<VideoSource>}
 */
export async function clipSource(video) {
  const [{ camera }, blob] = await Promise.all([
    fetched(CLIP_CAMERA_URL).then((response) => /** @type {Promise<{ camera: Camera }>} */ (response.json())),
    fetched(CLIP_URL).then((response) => response.blob()),
  ]);
  const url = URL.createObjectURL(blob);
  const listening = new AbortController();
  // Phones pause videos while the page is away, and leave them so.
  const playOn = () => void (document.visibilityState === "visible" && video.play().catch(() => undefined));
  document.addEventListener("visibilitychange", playOn, { signal: listening.signal });
  addEventListener("pageshow", playOn, { signal: listening.signal });
  const stop = () => {
    listening.abort();
    video.pause();
    video.removeAttribute("src");
    video.load();
    URL.revokeObjectURL(url);
  };
  video.muted = true;
  video.loop = true;
  video.src = url;
  try {
    await video.play();
  } catch (error) {
    stop();
    throw new DeepSftError("image-unreadable", "This browser cannot play the clip.", { cause: error });
  }
  return { kind: "clip", camera, stream: null, stop };
}

/** @param {string} url */
async function fetched(url) {
  const response = await fetch(url).catch(() => null);
  if (!response?.ok) throw new DeepSftError("image-unreadable", `${url} could not be fetched.`);
  return response;
}
