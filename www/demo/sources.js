// The bundled clip as the source of a scene, with its camera.

import { DeepSftError } from "deepsft";

/** @import { Camera } from "deepsft" */

/** The clip in each coding, the one to prefer first. */
const CLIPS = [
  { url: "demo/clip.mp4", type: 'video/mp4; codecs="avc1.64001f"' },
  { url: "demo/clip.webm", type: 'video/webm; codecs="vp8"' },
];
const CLIP_CAMERA_URL = "demo/clip.json";

/**
 * The bundled clip.
 *
 * @param {HTMLVideoElement} video
 * @param {AbortSignal} signal ends it, and frees the video
 */
export async function clipSource(video, signal) {
  const description = fetched(CLIP_CAMERA_URL, signal).then((response) => /** @type {Promise<{ camera: Camera }>} */ (response.json()));
  description.catch(() => undefined);
  // Phones pause videos while the page is away, and leave them so.
  const playOn = () => void (document.visibilityState === "visible" && video.play().catch(() => undefined));
  document.addEventListener("visibilitychange", playOn, { signal });
  addEventListener("pageshow", playOn, { signal });
  video.muted = true;
  video.loop = true;
  try {
    await playFirst(video, signal);
    const { camera } = await description;
    return { source: video, camera };
  } catch (error) {
    if (signal.aborted || error instanceof DeepSftError) throw error;
    throw new DeepSftError("image-unreadable", "This browser cannot play the clip.", { cause: error });
  }
}

/**
 * Plays the first coding that the browser does play. It is fetched whole, so that it also loops from servers that cannot seek. Some
 * browsers play no video from memory (WebKit on Linux): they get the address.
 *
 * @param {HTMLVideoElement} video
 * @param {AbortSignal} signal
 */
async function playFirst(video, signal) {
  /** @type {unknown} */
  let refusal = new Error("It knows none of the clip's codings.");
  for (const { url, type } of CLIPS) {
    if (video.canPlayType(type) === "") continue;
    const whole = URL.createObjectURL(await fetched(url, signal).then((response) => response.blob()));
    // From then on the video is another's, who may come at once.
    const free = () => {
      video.pause();
      video.removeAttribute("src");
      video.load();
      URL.revokeObjectURL(whole);
    };
    signal.throwIfAborted();
    signal.addEventListener("abort", free, { once: true });
    for (const address of [whole, url]) {
      video.src = address;
      try {
        return await video.play();
      } catch (error) {
        signal.throwIfAborted();
        // Everything else is not about the file: nothing may play by itself.
        if (!(error instanceof DOMException && error.name === "NotSupportedError")) throw error;
        refusal = error;
      }
    }
    signal.removeEventListener("abort", free);
    free();
  }
  throw refusal;
}

/**
 * @param {string} url
 * @param {AbortSignal} signal
 */
async function fetched(url, signal) {
  const response = await fetch(url, { signal }).catch(() => null);
  signal.throwIfAborted();
  if (!response?.ok) throw new DeepSftError("image-unreadable", `${url} could not be fetched.`);
  return response;
}
