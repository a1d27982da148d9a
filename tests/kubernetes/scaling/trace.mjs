// A trace of jobs: one morning and afternoon of a studio, with what is hard for an autoscaler. Times
// and durations are seconds.

// Mulberry32: the same numbers everywhere.
export function randomNumbers(seed) {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}

const minutes = (count) => 60 * count;

// Jobs at random times from begin to end, `every` seconds in the mean.
function stream(random, begin, end, every, make) {
  const jobs = [];
  for (let time = begin; ; ) {
    time += -every * Math.log(1 - random());
    if (time >= end) return jobs;
    jobs.push({ time, ...make() });
  }
}

function burst(time, count, make) {
  return Array.from({ length: count }, () => ({ time, ...make() }));
}

export const tooLarge = { time: minutes(20), gib: 80, seconds: 600 };
export const catalogAway = { begin: minutes(150), end: minutes(154) };
export const serverAway = { begin: minutes(140), end: minutes(142) };
export const end = minutes(260);

// In the order of their times; a job with `targets` is as many child jobs, then one of 20 s.
export function day(seed) {
  const random = randomNumbers(seed);
  const between = (low, high) => low + (high - low) * random();
  const imported = () => ({ gib: between(0.5, 2), seconds: between(20, 60) });
  const small = () => ({ gib: between(1, 4), seconds: between(60, 240) });
  const medium = () => ({ gib: between(5, 14), seconds: between(300, 600) });
  const large = () => ({ gib: between(30, 60), seconds: between(600, 900), targets: 5 });
  return [
    ...burst(minutes(1), 8, imported),
    ...stream(random, minutes(2), minutes(45), 45, small),
    ...stream(random, minutes(5), minutes(45), 300, medium),
    tooLarge,
    ...burst(minutes(30), 1, large),
    // A lull: half an hour without any job.
    ...stream(random, minutes(115), minutes(175), 60, small),
    ...burst(minutes(130), 60, imported),  // more than there may be workers
    ...burst(minutes(135), 6, medium),
    ...stream(random, minutes(145), minutes(175), 400, medium),
    ...burst(minutes(172), 1, small),
  ].sort((one, other) => one.time - other.time);
}
