// Dark or light: the system's setting, until the button is used.
import {el} from './dom.js';

/** `kept` has get() and set(theme), which store the choice of the button. */
export function themeButton(state, face, kept = null) {
  const system = matchMedia('(prefers-color-scheme: dark)');
  let isChosen = Boolean(kept?.get());
  const apply = (theme) => { document.documentElement.dataset.theme = theme; state.set({theme}); };
  const button = el('button', {type: 'button', class: 'icon', title: 'dark or light (t)', 'aria-label': 'dark or light', onclick: () => {
    apply(state.get('theme') === 'dark' ? 'light' : 'dark');
    isChosen = Boolean(kept);
    kept?.set(state.get('theme'));
  }}, face);
  apply(kept?.get() ?? (system.matches ? 'dark' : 'light'));
  system.addEventListener('change', () => { if (!isChosen) apply(system.matches ? 'dark' : 'light'); });
  return button;
}
