// Files that the user adds to the study: marks, a guess to correct, labels as structures.
import {el} from '../dom.js';

const MARKS = /\.(csv|tsv|txt|xyz|pts|asc|roi|zip|json|fcsv|annot)$/i;
const MAX_BYTES = 256 * 2 ** 20;  // kMaxFileBytes of the program
const ANSWER_TIMEOUT = 5000;  // maximum time in ms until the server has assigned the ID of a new structure

export class Files {
  constructor({study, tools, toast, queue}) {
    Object.assign(this, {study, tools, toast, queue});
    this.input = el('input', {type: 'file', hidden: true, 'aria-hidden': 'true', tabindex: -1, onchange: () => this.chosen()});
    addEventListener('dragover', (event) => { if (event.dataTransfer?.types.includes('Files')) event.preventDefault(); });
    addEventListener('drop', (event) => {
      const [file] = event.dataTransfer?.files ?? [];
      if (!file) return;
      event.preventDefault();
      this.send(file, MARKS.test(file.name) ? 'points' : 'guess');
    });
  }

  choose(as) {
    this.as = as;
    this.input.value = '';
    this.input.click();
  }

  chosen() {
    const [file] = this.input.files;
    if (file) this.send(file, this.as);
  }

  /** The ID of the active structure. If it is new, waits until the program has assigned the ID. */
  async structure() {
    const own = this.tools.open();
    if (!own) return null;
    const end = performance.now() + ANSWER_TIMEOUT;
    for (let id = own.id; performance.now() < end; id = this.study.resolve(own.id)) {
      if (typeof id === 'number') return id;
      await new Promise((done) => { setTimeout(done, 50); });
    }
    return void this.toast('Not connected yet.');
  }

  async send(file, as) {
    if (file.size > MAX_BYTES) return this.toast(`\u201c${file.name}\u201d is larger than 256 MiB: name it on the command line, covol mark IMAGE STUDY --guess FILE.`, 'failed');
    const id = as === 'labels' ? 0 : await this.structure();
    if (id === null || id === undefined) return undefined;
    const query = new URLSearchParams({key: this.queue.nextKey(), as, structure: String(id), name: file.name});
    try {
      const answer = await fetch(`/import?${query}`, {method: 'POST', body: file});
      if (!answer.ok) return this.toast((await answer.text()).trim(), 'failed');
      return this.toast(`\u201c${file.name}\u201d is part of the study: z takes it back.`);
    } catch {
      return this.toast('Not connected: the file was not sent.', 'failed');
    }
  }
}
