// Time that the page spends on the main thread for its frames.
let spentMs = 0;
let depth = 0;

/** Runs a part of that work. */
export function measured<T>(part: () => T): T {
  if (depth) return part();
  const begin = performance.now();
  ++depth;
  try {
    return part();
  } finally {
    --depth;
    spentMs += performance.now() - begin;
  }
}

/** Milliseconds since the last call. */
export function takeSpent(): number {
  const spent = spentMs;
  spentMs = 0;
  return spent;
}
