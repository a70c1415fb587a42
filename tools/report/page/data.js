// SPDX-License-Identifier: Apache-2.0
// The data of a report: read from <script type="application/json" id="data">, checked, completed and indexed.
//
// Contract, version 1. Lengths mm, angles degrees, images px, times s; matrices row-major; base64 arrays little-endian.
//   marrow, format (1), kind: "comparison" | "run" | "over_time"
//   over_time: {sequences, trials} as in curves.json; with it, only the experiment's name is read besides
//   experiment: {name, help, file (path of the YAML), text (its content), pipeline_text, seed, started, finished,
//     command (how to repeat), folder, machine: {cpu, cores, cpu_level}, plugins: [{file, build_id}],
//     starts_protocol, success_rule, time_rule}                       sentences
//   variants: [{name, is_baseline, options: {"NODE.uses": "KIND.NAME", "NODE.OPTION": value}}]
//   figures: [{name, columns: [name], rows: [{name, unit, values: [number | null per column]}]}]     of a run
//   passes: [{node, end, passes: [{name, status, seconds, reason}]}]     of a run whose nodes have bodies
//   profile: {us, rows: [title], names: [{title, kind, node}], bars: [[row, name, begin, length, thread's processor
//   time
//     or -1]] by row and beginning, busy: [[begin, {thread: processors}]], sums (as in the file of --profile),
//     left_out} of a run with a profile, in microseconds
//   metrics, comparisons, all_pairs, rankings, effects, curves, tuning, initial_error: as in comparison.json, whose
//   keys docs/comparing.md lists; the
//     first metric is the main one, and the variant of a comparison may be a name or an index
//   summary: its "variants"
//   cases: ["case-01", ...], starts: ["0", ...]
//   cells: [{id, variant, case, start (indices), status: "done" | "failed", reason, tries,
//     success: bool | null (no limits),
//     absent (why values are missing: a node failed, and the run may go on without it; may be missing itself),
//     initial_error, seconds, evaluations, cached_nodes, values: [number | null per metric],
//     key (first digits of the digest of what the row was made from; null or missing if it is not known),
//     verdict (the worst), failure_probability, verdicts: [{item, judgement: "trusted" | "doubtful" | "wrong",
//     failure_probability: number | null, reasons: [text], remedies: [text]}],          may be missing, as may be
//     poses: [{name, target, source, matrix: [16], deviations: [6: degrees, mm] | null,
//       has_bone_axes}],
//     trajectories: [{name, frames: [name], time_s: [number], found: [bool], world_from_model: [[16]],
//     motion: [[6: degrees, mm]] from the first frame along the bone's own axes, deviation: the same}],
//     pictures: [{name: "overlay/distal/frontal", picture: id}], convergence: [[evaluations, cost], ...] | null,
//     landscape: [{axis, unit, offsets: [...], costs: [...]}] | null, scene: id | null, folder}]
//   cell_table: {fields: [name of a field of a cell], rows: [[value per field, then one per metric]], texts: [text]}
//     instead of cells, a tenth as long: id and folder follow from the names of variant, case and start; the fields
//     status, reason, absent and verdict are places in texts, or null
//   materials: [{variant, case, start, and of a cell: pictures, convergence, landscape, scene, poses, verdicts,
//     trajectories}]     what is known of some cells of the table besides their row
//   parts: [{case, start, file, bytes, kinds: ["pictures" | "scene" | "convergence" | "landscape"]}]
//     materials of all cells of a case and start that are beside the page; parts.js loads them
//   pictures: {id: "data:image/webp;base64,..."}
//   geometries: {id: {vertices: base64 float32 xyz, triangles: base64 uint32}}     for meshes that several scenes share
//   scenes: {id: {meshes: [{name, vertices, triangles} or {name, geometry: id}],
//     poses: [{mesh: index, name: "result" | "truth" | "start", world_from_model: [16]}],
//     views: [{name, width_px, height_px, intrinsics: [9], camera_from_world: [16], image: picture id}]}}
//   graph: {nodes: [{id, uses, options: {}, differs: {variant name: text}}], edges: [{from, to, port}]}
// recipes.js reads the recipes from an element of their own.
// A camera is OpenCV's pinhole: +z to the detector, u right, v down, integer at pixel centres, origin at the X-ray
// source. "summary" and "comparisons" are left out where kind is "run"; any of pictures, convergence, landscape, scene
// may be missing.
import {withUnit} from './dom.js';
import * as Recipes from './recipes.js';

const FORMAT = 1;

const LISTS = [
  'figures', 'passes', 'variants', 'metrics', 'cases', 'starts', 'summary', 'comparisons', 'cells', 'materials', 'parts'
];
const IN_TEXTS = ['status', 'reason', 'absent', 'verdict'];

// The cells of a table, each as an object.
function cellsOf(data, {fields, rows, texts}) {
  const is_text = fields.map((name) => IN_TEXTS.includes(name));
  return rows.map((row) => {
    const cell = {};
    fields.forEach((name, i) => (cell[name] = is_text[i] && row[i] !== null ? texts[row[i]] : row[i]));
    cell.values = row.slice(fields.length);
    cell.id = [data.variants[cell.variant].name, data.cases[cell.case], data.starts[cell.start]].join('/');
    cell.folder = 'cells/' + cell.id;
    return cell;
  });
}

function completeCell(data, cell) {
  for (const name of ['values', 'verdicts', 'poses']) cell[name] = cell[name] || [];
  cell.pictures = (cell.pictures || []).filter((entry) => data.pictures[entry.picture]);
  cell.scene = data.scenes[cell.scene] ? cell.scene : null;
}

function complete(data) {
  for (const name of LISTS) data[name] = data[name] || [];
  for (const name of ['experiment', 'pictures', 'scenes', 'geometries']) data[name] = data[name] || {};
  for (const variant of data.variants) variant.options = variant.options || {};
  if (data.cell_table) data.cells = cellsOf(data, data.cell_table);
  delete data.cell_table;
  for (const cell of data.cells) completeCell(data, cell);
  return data;
}

// Adds to some cells what a part, or the page itself, holds besides their rows.
export function enter(data, {materials, pictures, geometries, scenes}) {
  Object.assign(data.pictures, pictures);
  Object.assign(data.geometries, geometries);
  Object.assign(data.scenes, scenes);
  for (const material of materials) {
    const pair = data.pairAt(material.case, material.start), cell = pair && pair.cells[material.variant];
    if (cell) completeCell(data, Object.assign(cell, material));
  }
}

// Cells by variant, case and start, and the (case, start) pairs with anything to look at.
function index(data) {
  const key = (caseIndex, start) => caseIndex * data.starts.length + start;
  data.is_run = data.kind === 'run';
  data.baseline = data.variants.findIndex((variant) => variant.is_baseline);
  data.pairs = [];
  data.cellsOf = data.variants.map(() => []);
  const byKey = new Map();
  for (const cell of data.cells) {
    (data.cellsOf[cell.variant] = data.cellsOf[cell.variant] || []).push(cell);
    const name = key(cell.case, cell.start);
    if (!byKey.has(name)) {
      byKey.set(name, {case: cell.case, start: cell.start, cells: []});
      data.pairs.push(byKey.get(name));
    }
    byKey.get(name).cells[cell.variant] = cell;
  }
  data.pairAt = (caseIndex, start) => byKey.get(key(caseIndex, start));
  data.pairOf = (cell) => data.pairAt(cell.case, cell.start);
  enter(data, {materials: data.materials});
  for (const part of data.parts) {
    const pair = data.pairAt(part.case, part.start);
    if (pair) pair.part = part;
  }
  data.lookedAt = data.pairs.filter((pair) => pair.part || pair.cells.some(hasMaterial));
  data.byId = new Map(data.cells.map((cell) => [String(cell.id), cell]));
  data.variantIndex = (variant) =>
      (typeof variant === 'number' ? variant : data.variants.findIndex((item) => item.name === variant));
  return data;
}

export const hasMaterial = (cell) => Boolean(
    cell && (cell.pictures.length || cell.scene || (cell.convergence || []).length || (cell.landscape || []).length));

// What can be looked at of a cell, here or in a part beside the page.
export function kinds(data, cell) {
  const {part} = data.pairOf(cell), beside = part && cell.status !== 'failed' ? part.kinds : [];
  return ['pictures', 'scene', 'convergence', 'landscape'].filter(
      (kind) => beside.includes(kind) || (kind === 'scene' ? cell.scene : (cell[kind] || []).length));
}

export function load() {
  const data = JSON.parse(document.getElementById('data').textContent);
  if (!(data.format <= FORMAT)) {
    throw new Error(
        'This page reads format ' + FORMAT + ' of a report\'s data, the data are in format ' + data.format +
        ': make the report again with one version of marrow.');
  }
  data.recipes = Recipes.load();
  return index(complete(data));
}

// The outcome of a cell: a failed one gave no pose; a missed one gave a pose that is not a success.
export function outcome(cell) {
  if (cell.status === 'failed') return 'failed';
  if (cell.success === true) return 'success';
  return cell.success === false ? 'missed' : 'done';
}

// The limit of success: below it, or above it where higher is better.
export const limit = (metric) => [metric.success_above, metric.success_below].find(Number.isFinite) ?? null;
export const limitText = (metric) =>
    (metric.higher_is_better ? 'above ' : 'below ') + withUnit(limit(metric), metric.unit);

// The value that 95 % of the runs reach or surpass.
export const worseEnd = (metric, item) => (metric.higher_is_better ? item.p5 : item.p95);

export const isBetter = (metric, value, base) => (metric.higher_is_better ? value > base : value < base);

// Quantile of sorted numbers, linear between the two neighbours.
export function quantile(sorted, fraction) {
  if (!sorted.length) return null;
  const position = fraction * (sorted.length - 1), low = Math.floor(position);
  return sorted[low] + (position - low) * ((sorted[low + 1] ?? sorted[low]) - sorted[low]);
}

// The finite values of a metric for one variant, with their cells.
export function valuesOf(data, variant, metric) {
  return data.cellsOf[variant]
      .filter((cell) => cell.status !== 'failed' && Number.isFinite(cell.values[metric]))
      .map((cell) => ({value: cell.values[metric], cell}));
}

// The (case, start) pairs in which both variant and baseline have a value.
export function pairedValues(data, variant, metric) {
  const finite = (cell) => cell && cell.status !== 'failed' && Number.isFinite(cell.values[metric]);
  return data.pairs.filter((pair) => finite(pair.cells[variant]) && finite(pair.cells[data.baseline]))
      .map((pair) => ({
             base: pair.cells[data.baseline].values[metric],
             value: pair.cells[variant].values[metric],
             cell: pair.cells[variant]
           }));
}

export const pairName = (data, pair) => data.cases[pair.case] + ', start ' + data.starts[pair.start];
export const cellName = (data, cell) => data.variants[cell.variant].name + ', ' + pairName(data, cell);
