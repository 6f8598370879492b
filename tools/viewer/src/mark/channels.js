// Displays several channels of an image together: each in a colour of its own, added up.
import {el} from '../dom.js';
import {greyTable} from '../grey.js';
import {menuItem} from '../menu.js';

const COLORS = [[70, 220, 90], [235, 75, 235], [70, 205, 235], [240, 215, 70], [245, 90, 75], [100, 140, 255]];
const hex = (rgb) => `#${rgb.map((v) => v.toString(16).padStart(2, '0')).join('')}`;
const rgb = (text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16));

/** The stored colours of the displayed channels by their numbers, as far as they are valid. */
export function keptMix(kept, {channels = []}) {
  const isColor = (color) => Array.isArray(color) && color.length === 3 && color.every((v) => Number.isInteger(v) && v >= 0 && v <= 255);
  return Object.fromEntries(Object.entries(kept ?? {}).filter(([n, color]) => Number(n) in channels && isColor(color)));
}

export class Channels {
  constructor({image, state, slices, toast}) {
    Object.assign(this, {image, state, slices, toast, facts: new Map([[image.channel, image]])});
    state.on(['window', 'colors', 'mix'], () => this.paint());
    const kept = state.get('mix');
    state.set({mix: {}});
    this.show(kept);
  }

  /** Shows only the channels in `mix`, colours by channel number. If it is empty, the channel of the marks is shown in grey. */
  async show(mix) {
    try {
      for (const n of Object.keys(mix).map(Number)) {
        if (this.facts.has(n)) continue;
        const answer = await fetch(`/channel?channel=${n}`);
        if (!answer.ok) throw new Error((await answer.text()).trim());
        this.facts.set(n, await answer.json());
      }
    } catch (error) {
      return this.toast(`This channel cannot be shown: ${error.message}`, 'failed');
    }
    this.slices.mixWith(Object.keys(mix).map(Number).filter((n) => n !== this.image.channel));
    this.state.set({mix});
    return undefined;
  }

  toggle(n) {
    const mix = {...this.state.get('mix')}, own = this.image.channel;
    if (n in mix) delete mix[n];
    else mix[n] = COLORS[n % COLORS.length];
    // If another channel is added, the channel of the marks gets a colour, too: in grey it would hide the other colour.
    if (n !== own && n in mix) mix[own] ??= COLORS[own % COLORS.length];
    if (Object.keys(mix).every((one) => Number(one) === own)) delete mix[own];
    return this.show(mix);
  }

  paint() {
    const {image, state} = this, mix = state.get('mix'), own = image.channel, others = Object.keys(mix).map(Number).filter((n) => n !== own);
    const isHidden = others.length > 0 && !(own in mix);
    const grey = greyTable(image, state.get('window'), isHidden ? [0, 0, 0] : mix[own] ?? state.get('colors'));
    grey.others = others.map((n) => [n, greyTable(this.facts.get(n), this.facts.get(n), mix[n])]);
    grey.key = [grey, ...grey.others.map(([, table]) => table)].map(({key}) => key).join(' + ') + others.join();
    state.set({grey});
  }

  /** Entries for the menu of grey values; none for a single channel. */
  items() {
    const {image, state} = this;
    if (image.channels.length < 2) return [];
    const mix = state.get('mix'), isShown = (n) => (Object.keys(mix).length > 0 ? n in mix : n === image.channel);
    const rows = image.channels.map((name, n) => {
      const check = menuItem(name, async () => {
        await this.toggle(n);
        rows.forEach(({check: one}, at) => one.setAttribute('aria-checked', String(at in state.get('mix') || (Object.keys(state.get('mix')).length === 0 && at === image.channel))));
      }, {role: 'menuitemcheckbox', 'aria-checked': String(isShown(n)), 'data-channel': n});
      const color = el('input', {type: 'color', class: 'swatch', value: hex(mix[n] ?? COLORS[n % COLORS.length]), 'aria-label': `colour of ${name}`, tabindex: -1,
        onchange: () => this.show({...state.get('mix'), [n]: rgb(color.value)})});
      return {check, row: el('div', {class: 'channel', role: 'none'}, check, color)};
    });
    return [el('h3', {}, 'Channels'), ...rows.map(({row}) => row)];
  }
}
