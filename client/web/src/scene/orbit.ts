// A camera that looks at a point from around it. All of its values are rounded, so that those in
// the URL give the same picture.
import { clamp, roundTo, roundToDigits } from '../base/numbers.ts';

export interface Orbit {
  azimuth: number; // degrees around the vertical axis, from +z towards +x
  elevation: number; // degrees above the horizon
  distance: number;
  target: [number, number, number];
}

export interface Sphere {
  center: [number, number, number];
  radius: number;
}

export const fieldOfView = 32; // degrees, vertical
const maxElevation = 89;
const rad = Math.PI / 180;

export function rounded(orbit: Orbit): Orbit {
  const azimuth = ((orbit.azimuth % 360) + 360) % 360;
  const [x, y, z] = orbit.target.map((value) => roundTo(value, 4)) as Orbit['target'];
  return {
    azimuth: roundTo(azimuth, 2),
    elevation: roundTo(clamp(orbit.elevation, -maxElevation, maxElevation), 2),
    distance: roundToDigits(orbit.distance, 6),
    target: [x, y, z],
  };
}

/** All of the sphere in view, from the side and a little above. */
export function fitted(sphere: Sphere, aspect: number): Orbit {
  const half = Math.min(
    fieldOfView / 2,
    Math.atan(Math.tan((fieldOfView / 2) * rad) * aspect) / rad,
  );
  const distance = (sphere.radius / Math.sin(half * rad)) * 0.92;
  return rounded({ azimuth: 24, elevation: 20, distance, target: sphere.center });
}

/** From the target to the camera, of length 1. */
export function backward({ azimuth, elevation }: Orbit): [number, number, number] {
  const level = Math.cos(elevation * rad);
  return [
    level * Math.sin(azimuth * rad),
    Math.sin(elevation * rad),
    level * Math.cos(azimuth * rad),
  ];
}

export function eyeOf(orbit: Orbit): [number, number, number] {
  const [x, y, z] = backward(orbit);
  const { target, distance } = orbit;
  return [target[0] + distance * x, target[1] + distance * y, target[2] + distance * z];
}

export function turned(orbit: Orbit, azimuth: number, elevation: number): Orbit {
  return rounded({
    ...orbit,
    azimuth: orbit.azimuth + azimuth,
    elevation: orbit.elevation + elevation,
  });
}

/** `factor` below 1: nearer. */
export function zoomed(orbit: Orbit, factor: number, radius: number): Orbit {
  const distance = clamp(orbit.distance * factor, radius * 0.05, radius * 50);
  return rounded({ ...orbit, distance });
}

/** Moves target and camera to the right and up, in heights of the picture. */
export function panned(orbit: Orbit, right: number, up: number): Orbit {
  const height = 2 * orbit.distance * Math.tan((fieldOfView / 2) * rad);
  const { azimuth, elevation, target } = orbit;
  const [sa, ca] = [Math.sin(azimuth * rad), Math.cos(azimuth * rad)];
  const [se, ce] = [Math.sin(elevation * rad), Math.cos(elevation * rad)];
  const x = right * height;
  const y = up * height;
  return rounded({
    ...orbit,
    target: [
      target[0] + x * ca - y * se * sa,
      target[1] + y * ce,
      target[2] - x * sa - y * se * ca,
    ],
  });
}
