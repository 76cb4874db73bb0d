// Whether this browser's WebGPU can run the engine, found out before the engine is loaded.

/** Names under which CPU emulations of a GPU appear, to WebGL too. */
export const SOFTWARE_NAMES = /swiftshader|llvmpipe|lavapipe|softpipe|basic render|\bwarp\b|software/i;

/**
 * Asks for the adapter the engine would get. All adapters but those of the compatibility mode, which is not asked for, have at least the
 * limits that the engine's kernels lean on.
 *
 * @returns whether it is usable, why not in a sentence, whether it is emulated on the CPU, and its name where the browser says it
 */
export async function probeWebGpu() {
  const gpu = /** @type {any} */ (navigator).gpu;
  const unusable = (/** @type {string} */ reason) => ({ usable: false, software: false, adapterName: "", reason });
  if (!gpu) return unusable("This browser has no WebGPU.");
  let adapter;
  try {
    adapter = await gpu.requestAdapter({ powerPreference: "high-performance" });
  } catch (error) {
    return unusable(`This browser's WebGPU failed: ${error instanceof Error ? error.message : error}.`);
  }
  if (!adapter) return unusable("This browser has WebGPU but offers no graphics adapter.");
  const { vendor = "", architecture = "", device = "", description = "", isFallbackAdapter } = adapter.info ?? {};
  const software =
    isFallbackAdapter === true || SOFTWARE_NAMES.test([vendor, architecture, device, description].join(" "));
  const adapterName = [vendor, architecture, description].filter(Boolean).join(" ");
  return { usable: true, software, adapterName, reason: "" };
}
