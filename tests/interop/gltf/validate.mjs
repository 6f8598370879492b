// Prints the report of Khronos' glTF validator for each file. The exit code is 1 if a file has an error or a warning.
import fs from "node:fs";
import validator from "gltf-validator";

let bad = 0;
for (const path of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(path)), { uri: path });
  const { numErrors, numWarnings, numInfos, messages } = report.issues;
  console.log(`${path}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} remarks, ` +
    `${report.info.totalVertexCount} vertices, ${report.info.totalTriangleCount} triangles`);
  for (const { code, message, pointer } of messages) console.log(`  ${code} ${pointer}: ${message}`);
  bad += numErrors + numWarnings;
}
process.exit(bad > 0 ? 1 : 0);
