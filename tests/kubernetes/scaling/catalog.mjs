// The catalog of replay_catalog.cc.
import { spawn } from 'node:child_process';
import { createInterface } from 'node:readline';

export class Catalog {
  constructor(file) {
    this.process = spawn(process.env.REPLAY_CATALOG, [file],
      { stdio: ['pipe', 'pipe', 'inherit'] });
    this.lines = createInterface({ input: this.process.stdout })[Symbol.asyncIterator]();
  }

  async line() {
    const { value, done } = await this.lines.next();
    if (done) throw new Error('replay_catalog has ended');
    return value;
  }

  async ask(command) {
    this.process.stdin.write(`${command}\n`);
    return this.line();
  }

  async metrics() {
    const lines = [await this.ask('metrics')];
    while (lines.at(-1) !== '.') lines.push(await this.line());
    return `${lines.slice(0, -1).join('\n')}\n`;
  }

  close() {
    this.process.stdin.end();
  }
}
