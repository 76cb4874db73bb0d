// Keeps the screen on while a video is looked at: nobody touches the phone meanwhile.

/** @param {AbortSignal} signal ends it */
export function keepAwake(signal) {
  const take = async () => {
    if (document.visibilityState === "hidden") return;
    // Refused where the battery is low; some browsers have none. The screen then goes off as it always does.
    const lock = await navigator.wakeLock?.request("screen").catch(() => null);
    const letGo = () => void lock?.release().catch(() => undefined);
    if (signal.aborted) letGo();
    else signal.addEventListener("abort", letGo);
  };
  // Browsers take it back while the page is away.
  document.addEventListener("visibilitychange", take, { signal });
  void take();
}
