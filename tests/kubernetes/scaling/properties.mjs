// What must be true of a simulated class of workers. Each returns the times at which it is not.

// Samples of the `seconds` before and at each time.
function windows(samples, seconds) {
  return samples.map((sample, k) => {
    let begin = k;
    while (begin > 0 && samples[begin - 1].time >= sample.time - seconds) --begin;
    return samples.slice(begin, k + 1);
  });
}

const jobsOf = (window) => window.map(({ jobs }) => jobs);
const overlaps = (window, span, more) => Boolean(span) && window.at(-1).time >= span.begin &&
  window[0].time <= span.end + more;

// But for when the catalog was away, and a minute after.
function timesWhere(samples, seconds, { catalogAway }, isWrong) {
  return windows(samples, seconds)
    .filter((window) => window.at(-1).time - window[0].time >= seconds)
    .filter((window) => !overlaps(window, catalogAway, 60))
    .filter(isWrong)
    .map((window) => window.at(-1).time);
}

// Without jobs there are soon as few workers as may be.
export const empties = ({ samples }, options) => timesWhere(samples, 360, options, (window) =>
  Math.max(...jobsOf(window)) === 0 && window.at(-1).replicas !== options.least);

// With jobs there are soon workers.
export const comesBack = ({ samples }, options) => timesWhere(samples, 60, options, (window) =>
  Math.min(...jobsOf(window)) > 0 && window.at(-1).replicas === 0);

// ... and after a while as many as jobs, but for a tenth, or the most that are allowed.
export const follows = ({ samples }, options) => timesWhere(samples, 120, options, (window) =>
  window.at(-1).replicas < Math.min(options.most, Math.floor(0.9 * Math.min(...jobsOf(window)))));

// Never more workers than there were jobs that need them.
export const countsOnce = ({ samples }, options) => timesWhere(samples, 600, options, (window) =>
  window.at(-1).replicas > Math.max(options.least, ...jobsOf(window)));

// Workers that were stopped are not missed: none are started within ten minutes of a stop while
// there are no more jobs than there were, for half a minute or longer, in the four minutes before
// it (which nobody saw while the catalog was away). What the autoscaler sees is up to half a minute
// old.
export function flaps({ samples }, { catalogAway }) {
  const lasting = windows(samples, 30).map((window) => Math.min(...jobsOf(window)));
  const since = (k, seconds) =>
    samples.findIndex(({ time }) => time >= samples[k].time - seconds);
  const found = [];
  for (let k = 1; k < samples.length; ++k) {
    if (samples[k].replicas <= samples[k - 1].replicas) continue;
    const first = since(k, 600);
    let stop = k - 1;
    while (stop > first && samples[stop].replicas >= samples[stop - 1].replicas) --stop;
    if (stop <= first || overlaps(samples.slice(stop, k), catalogAway, 300)) continue;
    const before = Math.max(...lasting.slice(since(stop, 240), since(stop, 15)));
    const now = Math.max(...jobsOf(samples.slice(since(k, 30), k + 1)));
    if (now <= before) found.push(samples[k].time);
  }
  return found;
}

// While the catalog is away nothing is stopped or started.
export const keepsStill = ({ samples }, { catalogAway }) => {
  const during = samples.filter(({ time }) =>
    catalogAway && time > catalogAway.begin + 30 && time < catalogAway.end);
  return during.filter(({ replicas }) => replicas !== during[0].replicas).map(({ time }) => time);
};

export const properties = [empties, comesBack, follows, countsOnce, flaps, keepsStill];
