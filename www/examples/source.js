// What the examples look at: the camera, or with ?clip the demo page's clip, which a known camera has taken.

import { openCamera } from "deepsft";

const canPlay = document.createElement("video").canPlayType('video/mp4; codecs="avc1.64001f"');
export const clip = new URL(`../demo/clip.${canPlay ? "mp4" : "webm"}`, import.meta.url).href;

export async function openSource(video) {
  if (location.search !== "?clip") return { source: await openCamera(video) };
  await Object.assign(video, { crossOrigin: "anonymous", src: clip, muted: true, loop: true, playsInline: true }).play();
  return { source: video, intrinsics: { width: 960, height: 540, fx: 760, fy: 760, cx: 480, cy: 270 } };
}

/** For `start` of `deepsft/scene`, which opens the camera itself. */
export async function sourceOptions() {
  if (location.search !== "?clip") return {};
  const video = document.createElement("video");
  document.body.append(video);
  const { source, intrinsics } = await openSource(video);
  return { source, camera: intrinsics };
}
