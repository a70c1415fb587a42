// SPDX-License-Identifier: Apache-2.0
// The angles and distances of a C-arm as fields. Nothing is filled in that nobody gave: a guessed number looks like a
// measured one.
import {el, labelled} from '../../report/page/dom.js';

// The keys of docs/case.md, what they may be at all, and what they usually are.
const FIELDS = [
  {
    key: 'alpha_deg',
    label: 'Cranio-caudal angle, degrees',
    where: 'Positive if the detector is towards the head. The display of the C-arm says CRAN for +, CAUD for −.',
    possible: [-90, 90],
    usual: [-45, 45]
  },
  {
    key: 'beta_deg',
    label: 'Right/left anterior angle, degrees',
    where: 'Positive if the detector is on the patient’s left. The display says LAO for +, RAO for −.',
    possible: [-180, 180],
    usual: [-120, 120]
  },
  {
    key: 'source_to_detector_mm',
    label: 'Source to detector, mm',
    where: 'SID on the display, or in the manual. In a DICOM header (0018,1110).',
    possible: [1, 10000],
    usual: [800, 1500],
    stays: true
  },
  {
    key: 'source_to_isocentre_mm',
    label: 'Source to isocentre, mm',
    where: 'In the manual: from the source to the point about which the arm turns. In a DICOM header (0018,1111).',
    possible: [1, 10000],
    usual: [400, 1000],
    stays: true
  },
  {
    key: 'pixel_mm',
    label: 'Size of a pixel on the detector, mm',
    where: 'The width of the field on the detector, in mm, divided by the columns of the image. In a DICOM header ' +
        '(0018,1164).',
    possible: [0.001, 100],
    usual: [0.1, 0.6],
    stays: true
  }
];

function fieldOf({key, label, where, possible: [min, max], usual, stays}, known, before) {
  const given = known ? known[key] : stays && before ? before.c_arm[key] : undefined;
  const note = el('small', {class: 'arm-note'}), id = 'arm-' + key;
  const box = el('input', {
    type: 'number',
    step: 'any',
    required: true,
    min,
    max,
    value: given === undefined ? '' : given,
    placeholder: `usually ${usual[0]} to ${usual[1]}`,
    'data-arm': key,
    'aria-describedby': id,
    oninput: () => tell()
  });
  note.id = id;
  const tell = () => {
    const value = Number(box.value), is_odd = box.value !== '' && (value < usual[0] || value > usual[1]);
    const source = !known && given !== undefined && Number(box.value) === given ? `As in ${before.name}. ` : '';
    note.classList.toggle('odd', is_odd);
    note.textContent =
        is_odd ? `${box.value} is unusual; usual are ${usual[0]} to ${usual[1]}. ${where}` : source + where;
  };
  tell();
  return {key, box, element: el('div', {class: 'arm-field'}, labelled(label, box), note)};
}

// known: the view's own values. before: {name, c_arm} of another view, whose distances this one has, too. values()
// gives the numbers; first() is the first field without a number.
export function armFields(known, before) {
  const fields = FIELDS.map((field) => fieldOf(field, known, before));
  return {
    element: el('div', {class: 'arm-fields'}, fields.map((one) => one.element)),
    values: () => Object.fromEntries(fields.map(({key, box}) => [key, Number(box.value)])),
    first: () => (fields.find(({box}) => box.value === '') || fields[0]).box
  };
}
