// The WebSocket: sends queued actions in order, and reconnects when the connection is lost.
import {Store} from '../store.js';

const MAX_IN_FLIGHT = 64;
const ANSWER_TIMEOUT = 15000;  // ms without an answer, after which the connection is considered lost
const WAITS = [200, 400, 800, 1500, 2500, 4000];

export class Connection {
  /** `state` gets "link": connecting, open, lost, refused or other, and "waiting", the number of actions. */
  constructor(study, queue, state) {
    Object.assign(this, {study, queue, state, number: 0, tries: 0, isOpen: false});
    study.on('action', () => { this.flush(); this.count(); });
    study.on('gap', () => this.socket?.close());
    addEventListener('online', () => this.reconnectNow());
    document.addEventListener('visibilitychange', () => { if (!document.hidden) this.reconnectNow(); });
    setInterval(() => this.checkPatience(), 2000);
  }

  open() {
    clearTimeout(this.timer);
    this.timer = null;
    const socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/live`);
    this.socket = socket;
    ++this.number;
    socket.addEventListener('message', (event) => { if (socket === this.socket) this.receive(JSON.parse(event.data)); });
    socket.addEventListener('close', () => { if (socket === this.socket) this.closed(); });
  }

  receive(message) {
    if (message.state && !this.welcome(message.state)) return;
    this.study.receive(message);
    if (!message.state) return;
    this.isOpen = true;
    this.tries = 0;
    this.state.set({link: 'open'});
    this.flush();
    this.count();
  }

  /** Handles the first state of a connection. Returns whether the server has the study that the page shows. */
  welcome(state) {
    if (this.study.name === null) {
      this.study.name = state.study;
      this.queue.open(new Store(`covol-mark/actions/${state.study}`));
    } else if (this.study.name !== state.study) {
      this.state.set({link: 'other'});
      const socket = this.socket;
      this.socket = null;
      this.isOpen = false;
      socket.close();
      return false;
    }
    return true;
  }

  async closed() {
    this.isOpen = false;
    this.socket = null;
    this.state.set({link: this.study.name === null ? 'connecting' : 'lost'});
    this.count();
    this.timer = setTimeout(() => this.open(), WAITS[Math.min(this.tries++, WAITS.length - 1)]);
    if (this.tries < 2) return;
    try {  // status 403: the server was restarted, and does not accept the cookie of its earlier run
      const answer = await fetch('/image', {method: 'HEAD'});
      if (answer.status === 403 && !this.isOpen) this.state.set({link: 'refused'});
    } catch { /* no server is running */ }
  }

  reconnectNow() {
    if (!this.timer) return;
    this.tries = 0;
    this.open();
  }

  checkPatience() {
    const oldest = this.queue.items.find((item) => item.seq === null && item.sentOn === this.number);
    if (this.isOpen && oldest && performance.now() - oldest.sentAt > ANSWER_TIMEOUT) this.socket.close();
  }

  count() { this.state.set({waiting: this.queue.waiting}); }

  flush() {
    if (!this.isOpen) return;
    let onTheWay = 0;
    for (const item of this.queue.items) {
      if (item.seq !== null) continue;
      if (item.sentOn !== this.number) {
        // An action that refers to an object without an ID has to wait for it. The later actions wait, too, because the
        // order must not change.
        if (onTheWay >= MAX_IN_FLIGHT || !this.queue.isReady(item)) return;
        item.sentOn = this.number;
        item.sentAt = performance.now();
        this.socket.send(JSON.stringify(item.action));
      }
      ++onTheWay;
    }
  }

  /** Sends a query, which is not queued. Returns false if it cannot be sent. */
  ask(what, structure) {
    if (!this.isOpen || typeof structure === 'string') return false;
    this.socket.send(JSON.stringify({key: this.queue.nextKey(), ask: what, structure}));
    return true;
  }
}

