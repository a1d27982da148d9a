// A Prometheus that is given what it would scrape, at simulated times, by its remote write protocol
// (version 0.1.0).
import { spawn } from 'node:child_process';
import { once } from 'node:events';
import { writeFileSync } from 'node:fs';

function varint(number) {
  const bytes = [];
  for (let rest = BigInt(number); ; rest >>= 7n) {
    if (rest < 0x80n) return Buffer.from([...bytes, Number(rest)]);
    bytes.push(Number(rest & 0x7fn) | 0x80);
  }
}

// Fields of a message of protobuf.
const field = (number, bytes) =>
  Buffer.concat([varint(number << 3 | 2), varint(bytes.length), bytes]);
const text = (number, value) => field(number, Buffer.from(value));
const integer = (number, value) => Buffer.concat([varint(number << 3), varint(value)]);
function double(number, value) {
  const bytes = Buffer.alloc(8);
  if (value === null) bytes.writeBigUInt64LE(0x7ff0000000000002n);  // the marker of a stale series
  else bytes.writeDoubleLE(value);
  return Buffer.concat([varint(number << 3 | 1), bytes]);
}

// Snappy's block format, of literals alone.
function snappy(bytes) {
  const chunks = [varint(bytes.length)];
  for (let begin = 0; begin < bytes.length; begin += 65536) {
    const literal = bytes.subarray(begin, begin + 65536);
    const length = Buffer.alloc(2);
    length.writeUInt16LE(literal.length - 1);
    chunks.push(Buffer.from([61 << 2]), length, literal);
  }
  return Buffer.concat(chunks);
}

// The series of a text of metrics: {labels, value}.
export function seriesOf(metrics) {
  return metrics.split('\n').filter((line) => line && !line.startsWith('#')).map((line) => {
    const [, name, labels = '', value] = /^(\w+)(?:\{(.*)\})? (\S+)$/.exec(line);
    const found = [...labels.matchAll(/(\w+)="([^"\\]*)"/g)].map(([, key, of]) => [key, of]);
    return { labels: { __name__: name, ...Object.fromEntries(found) }, value: Number(value) };
  });
}

export class Prometheus {
  async start(folder) {
    writeFileSync(`${folder}/prometheus.yml`, '');
    this.process = spawn(process.env.PROMETHEUS, [`--config.file=${folder}/prometheus.yml`,
      `--storage.tsdb.path=${folder}/data`, '--web.listen-address=127.0.0.1:0',
      '--web.enable-remote-write-receiver'], { stdio: ['ignore', 'ignore', 'pipe'] });
    this.exited = once(this.process, 'exit');
    this.url = `http://${await this.addressInLog()}`;
    while (!(await fetch(`${this.url}/-/ready`)).ok);
  }

  // The log is read to its end: Prometheus would end with its reader.
  addressInLog() {
    let log = '';
    return new Promise((resolve, reject) => {
      this.process.stderr.on('data', (chunk) => {
        log += chunk;
        const found = /msg="Listening on" address=(\S+)/.exec(log);
        if (found) resolve(found[1]);
      });
      this.exited.then(() => reject(new Error(`Prometheus has ended: ${log}`)));
    });
  }

  // Samples of series {labels, value}; value null: the series has ended.
  async write(series, seconds) {
    const message = Buffer.concat(series.map(({ labels, value }) => field(1, Buffer.concat([
      ...Object.keys(labels).sort().map((key) =>
        field(1, Buffer.concat([text(1, key), text(2, labels[key])]))),
      field(2, Buffer.concat([double(1, value), integer(2, Math.round(1000 * seconds))])),
    ]))));
    const answer = await fetch(`${this.url}/api/v1/write`, { method: 'POST', body: snappy(message),
      headers: { 'Content-Encoding': 'snappy', 'Content-Type': 'application/x-protobuf',
        'X-Prometheus-Remote-Write-Version': '0.1.0' } });
    if (!answer.ok) throw new Error(await answer.text());
  }

  // The values of a query at a time, without their labels.
  async values(query, seconds) {
    const parameters = new URLSearchParams({ query, time: String(seconds) });
    const answer = await (await fetch(`${this.url}/api/v1/query?${parameters}`)).json();
    if (answer.status !== 'success') throw new Error(answer.error);
    return answer.data.result.map(({ value }) => Number(value[1]));
  }

  async close() {
    this.process.kill();
    await this.exited;
  }
}
