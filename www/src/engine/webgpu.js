// Whether this browser's WebGPU can run the engine, found out before the engine is loaded.

/**
 * Limits the engine's kernels lean on. They are WebGPU's guaranteed minimum; they are checked because
 * compatibility-mode adapters offer less.
 */
const NEEDED_LIMITS = /** @type {const} */ ({
  maxComputeInvocationsPerWorkgroup: 256,
  maxComputeWorkgroupStorageSize: 16_384,
  maxStorageBuffersPerShaderStage: 8,
  maxStorageBufferBindingSize: 134_217_728,
});

/** Names under which CPU emulations of a GPU appear. */
const SOFTWARE_NAMES = /swiftshader|llvmpipe|lavapipe|softpipe|basic render|\bwarp\b|software/i;

/**
 * @typedef {object} WebGpuProbe
 * @property {boolean} usable
 * @property {boolean} software whether the adapter is emulated on the CPU
 * @property {string} adapterName empty where the browser does not say
 * @property {string} reason a sentence when not usable, else empty
 */

/**
 * Asks for the adapter the engine would get.
 *
 * @returns {Promise<WebGpuProbe>}
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
  for (const [name, needed] of Object.entries(NEEDED_LIMITS)) {
    if (!(adapter.limits[name] >= needed))
      return unusable(`The graphics adapter's ${name} is ${adapter.limits[name]}; ${needed} is needed.`);
  }
  const { vendor = "", architecture = "", device = "", description = "", isFallbackAdapter } = adapter.info ?? {};
  const software =
    isFallbackAdapter === true || SOFTWARE_NAMES.test([vendor, architecture, device, description].join(" "));
  const adapterName = [vendor, architecture, description].filter(Boolean).join(" ");
  return { usable: true, software, adapterName, reason: "" };
}
