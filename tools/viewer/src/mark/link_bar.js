// The bar that reports a missing connection to the server.
import {el} from '../dom.js';

const LINKS = {
  lost: (n) => `Not connected. ${n === 0 ? 'It is tried again.' : `${n} action${n === 1 ? ' is' : 's are'} kept and will be sent.`}`,
  connecting: () => 'Not connected yet. It is tried again.',
  refused: (n) => `The server was started anew: open the address that it printed.${n === 0 ? '' : ` ${n} action${n === 1 ? ' is' : 's are'} kept and will be sent from there.`}`,
  other: () => 'Another study is open on this address now.',
};

export function linkBar(state) {
  const text = el('span', {}), again = el('button', {type: 'button', onclick: () => location.reload()}, 'Open it');
  const element = el('div', {class: 'link', role: 'alert', hidden: true}, text, again);
  let timer = null;
  const update = () => {
    const link = state.get('link'), tell = LINKS[link];
    if (tell) text.textContent = tell(state.get('waiting'));
    again.hidden = link !== 'other';
    clearTimeout(timer);
    // A page that is loading is usually connected soon: the bar is shown only if there is no connection after 1.2 s.
    if (link === 'connecting' && element.hidden) timer = setTimeout(() => { element.hidden = !LINKS[state.get('link')]; }, 1200);
    else element.hidden = !tell;
  };
  state.on(['link', 'waiting'], update);
  update();
  return element;
}
