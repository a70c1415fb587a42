// SPDX-License-Identifier: Apache-2.0
// Asks VS Code's library for JSON what an editor shows at places of a file: {schema, questions: [{text, at}]} comes in,
// [{completions: {label: inserted text}, hover, faults}] goes out.
const {readFileSync} = require("node:fs");
const {createRequire} = require("node:module");
const {getLanguageService, TextDocument} = createRequire(process.cwd() + "/")("vscode-json-languageservice");

async function answer(service, {text, at}) {
  const file = TextDocument.create("file:///pipeline.json", "json", 1, text);
  const parsed = service.parseJSONDocument(file);
  const place = file.positionAt(at);
  const {items} = await service.doComplete(file, place, parsed);
  const hover = await service.doHover(file, place, parsed);
  const faults = await service.doValidation(file, parsed);
  return {
    completions: Object.fromEntries(items.map((item) => [item.label, item.textEdit?.newText ?? item.insertText])),
    hover: hover ? [hover.contents].flat().join("\n").replace(/\\/g, "") : "",  // Markdown's marks
    faults: faults.map((fault) => fault.message),
  };
}

async function main() {
  const {schema, questions} = JSON.parse(readFileSync(0, "utf8"));
  const service = getLanguageService({});
  service.configure({validate : true, schemas : [ {uri : "marrow:pipeline", fileMatch : ["*"], schema} ]});
  const answers = [];
  for (const question of questions) answers.push(await answer(service, question));
  process.stdout.write(JSON.stringify(answers));
}

main();
