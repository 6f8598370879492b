// Options for segmenting all structures of the study; the program chooses values for empty fields.
import {el} from '../dom.js';

export function optionsSheet({study, unitText}) {
  const unit = unitText ? ` (${unitText})` : '';
  const field = (name, label, more) => [name, label, el('input', {type: 'number', step: 'any', min: 0, placeholder: 'automatic', name, ...more})];
  const fields = [field('voxel_size', `voxel size of the surface${unit}`), field('mark_precision', `precision of marks${unit}`), field('rho', 'weight of the image, 0 to 1', {max: 1})];
  const model = el('select', {name: 'model'}, [['', 'automatic'], ['guided', 'guided'], ['paper', 'paper']].map(([value, text]) => el('option', {value}, text)));
  const form = el('form', {method: 'dialog', onsubmit: () => {
    const options = Object.fromEntries(fields.filter(([, , input]) => input.value !== '').map(([name, , input]) => [name, Number(input.value)]));
    if (model.value) options.model = model.value;
    if (JSON.stringify(options) !== JSON.stringify(study.options)) study.act({do: 'set_options', options});
  }}, fields.map(([, label, input]) => el('label', {}, el('span', {}, label), input)), el('label', {}, el('span', {}, 'model'), model),
  el('p', {class: 'hint'}, 'Of all structures of this study, in ', el('code', {}, 'covol segment --study'), ' as well. All surfaces are found anew.'), el('div', {class: 'row'}, el('button', {type: 'submit', class: 'primary'}, 'Apply')));
  const dialog = el('dialog', {class: 'help options', 'aria-label': 'options of the study', onclick: (event) => { if (event.target === dialog) dialog.close(); }},
    el('div', {class: 'help-head'}, el('h2', {}, 'Options'), el('button', {type: 'button', class: 'icon', 'aria-label': 'close', onclick: () => dialog.close()}, '\u2715')), form);
  return {dialog, open: () => {
    for (const [name, , input] of fields) input.value = study.options[name] ?? '';
    model.value = study.options.model ?? '';
    dialog.showModal();
  }};
}
