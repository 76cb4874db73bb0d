// Keeps the screen on while a video is looked at: nobody touches the phone meanwhile.

/** @param {AbortSignal} signal ends it */
export function keepAwake(signal) {
  /** @type {WakeLockSentinel | null | undefined} */
  let lock;
  const letGo = () => void lock?.release().catch(() => undefined);
  const take = async () => {
    if (document.visibilityState === "hidden") return;
    // Refused where the battery is low; some browsers have none. The screen then goes off as it always does.
    const taken = await navigator.wakeLock?.request("screen").catch(() => null);
    letGo();
    lock = taken;
    if (signal.aborted) letGo();
  };
  // Browsers take it back while the page is away.
  document.addEventListener("visibilitychange", take, { signal });
  signal.addEventListener("abort", letGo);
  void take();
}
