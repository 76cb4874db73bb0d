export type Camera = {
    /**
     * image width, pixels
     */
    width: number;
    /**
     * image height, pixels
     */
    height: number;
    /**
     * focal length along x, pixels
     */
    fx: number;
    /**
     * focal length along y, pixels
     */
    fy: number;
    /**
     * principal point, pixels
     */
    cx: number;
    /**
     * principal point, pixels
     */
    cy: number;
    /**
     * (k1, k2, p1, p2, k3), OpenCV's order; none when absent
     */
    distortion?: readonly number[];
    /**
     * the (k1, k2, k3, k4) of OpenCV's `cv::fisheye`, in place of `distortion`, for lenses that
     * see more than about 100 degrees
     */
    fisheye?: readonly number[];
};
export type CameraSource = "given" | "calibrated" | "exif" | "estimated";
export type KnownCamera = Camera & {
    source?: CameraSource;
    spread?: number;
};
export type CameraOption = KnownCamera | ((width: number, height: number) => KnownCamera);
export type SourcedCamera = Camera & {
    distortion: readonly number[];
    source: CameraSource;
    spread?: number;
};
/**
 * A camera. Pixels are measured from the image's corner: the first pixel's centre is (0.5, 0.5).
 *
 * @typedef {object} Camera
 * @property {number} width image width, pixels
 * @property {number} height image height, pixels
 * @property {number} fx focal length along x, pixels
 * @property {number} fy focal length along y, pixels
 * @property {number} cx principal point, pixels
 * @property {number} cy principal point, pixels
 * @property {readonly number[]} [distortion] (k1, k2, p1, p2, k3), OpenCV's order; none when absent
 * @property {readonly number[]} [fisheye] the (k1, k2, k3, k4) of OpenCV's `cv::fisheye`, in place of `distortion`, for lenses that
 *   see more than about 100 degrees
 */
/**
 * Where intrinsics come from: the caller, a calibration made in this browser (by a sheet that moves, or one in a photograph), a
 * photograph's EXIF data, or the typical phone.
 *
 * @typedef {"given" | "calibrated" | "exif" | "estimated"} CameraSource
 */
/** @typedef {Camera & { source?: CameraSource, spread?: number }} KnownCamera */
/**
 * A camera, or a function that gives the camera for an image size; after a phone is turned it is asked again.
 * Without one the camera is estimated.
 *
 * @typedef {KnownCamera | ((width: number, height: number) => KnownCamera)} CameraOption
 */
/**
 * `spread` is the standard deviation of the focal length where it is known, pixels.
 *
 * @typedef {Camera & { distortion: readonly number[], source: CameraSource, spread?: number }} SourcedCamera
 */
/**
 * The cameras of the paper by name (its table of intrinsics), as the command line program knows them. One device differs from
 * the next by a few per cent.
 *
 * @type {Readonly<Record<"kinect-v2" | "realsense-d435" | "gopro-hero3", Readonly<Camera>>>}
 */
export declare const PAPER_CAMERAS: Readonly<Record<"kinect-v2" | "realsense-d435" | "gopro-hero3", Readonly<Camera>>>;
/**
 * Focal length of an unknown camera as a fraction of its image's long side: the median of a public table of 98
 * phones. Four of five lie within 0.73 and 1.01, so depth from it may be off by a sixth.
 */
export declare const TYPICAL_FOCAL_FRACTION = 0.79;
/**
 * The guess for an image of unknown origin: principal point at the centre, focal length
 * {@link TYPICAL_FOCAL_FRACTION} of the long side.
 *
 * @param {number} width pixels
 * @param {number} height pixels
 */
export declare function estimatedCamera(width: number, height: number): SourcedCamera;
/**
 * A camera with square pixels and its principal point at the centre.
 *
 * @param {number} width pixels
 * @param {number} height pixels
 * @param {number} focal pixels
 * @param {CameraSource} source
 * @returns {SourcedCamera}
 */
export declare function centredCamera(width: number, height: number, focal: number, source: CameraSource): SourcedCamera;
/**
 * Checks a camera against the image it is for. A camera for the same picture at another scale is scaled, and one for it turned by a quarter
 * is turned clockwise, as a phone that is held upright turns its picture.
 *
 * @param {KnownCamera} camera
 * @param {number} width of the image, pixels
 * @param {number} height of the image, pixels
 * @returns {SourcedCamera}
 * @throws {DeepSftError} `camera-intrinsics` when a number is impossible or the image has another shape
 */
export declare function cameraForImage(camera: KnownCamera, width: number, height: number): SourcedCamera;
/**
 * The camera of an image that may have been made smaller on its way.
 *
 * @param {CameraOption | undefined} option
 * @param {{ frame: { width: number, height: number }, width: number, height: number }} image the frame as it goes to the
 *   engine, and the size with which it came, pixels
 * @throws {DeepSftError} `camera-intrinsics`
 */
export declare function cameraForFrame(option: CameraOption | undefined, { frame, width, height }: {
    frame: {
        width: number;
        height: number;
    };
    width: number;
    height: number;
}): SourcedCamera;
/**
 * A camera's numbers in the order the engine takes them.
 *
 * @param {SourcedCamera} camera
 * @returns {number[]} fx, fy, cx, cy, k1, k2, p1, p2, k3; of a fisheye fx, fy, cx, cy, k1, k2, k3, k4
 */
export declare function intrinsicsOf({ fx, fy, cx, cy, distortion, fisheye }: SourcedCamera): number[];
