// SPDX-License-Identifier: GPL-3.0-or-later
// Job type for Flamenco: levels of detail for a list of mesh files, one task a file. See docs/batch.md.

const JOB_TYPE = {
  label: "ESO LOD: levels of detail",
  description: "Write the levels of detail of each mesh file in a list.",
  settings: [
    { key: "files", type: "string", required: true, propargs: { maxlen: 0 },
      description: "Mesh files, one a line or with ; between them, as the workers see them" },
    { key: "input_dir", type: "string", subtype: "dir_path", required: false,
      description: "Folder above the files: they keep their places below it. Empty: all levels go to one folder" },
    { key: "output_dir", type: "string", subtype: "dir_path", required: true, description: "Folder for the levels" },
    { key: "levels", type: "string", required: true, default: "--ratios 0.5,0.25,0.1",
      description: "What the levels are: --ratios, --faces, --errors or --sizes, and other words of `lod`" },
    { key: "profile", type: "string", default: "plain",
      choices: ["plain", "unity", "unreal", "godot", "gltf", "secondlife"], description: "Engine that names the levels" },
    { key: "ending", type: "string", default: "", description: "As .glb; empty: as each file" },
    { key: "chunk_size", type: "int32", default: 1, description: "Files in one task", visible: "submission" },
  ],
};

function compileJob(job) {
  const settings = job.settings;
  const files = listFiles(settings.files);
  if (!files.length) throw new Error("ESO LOD: the list of files is empty");
  const size = Math.max(1, settings.chunk_size || 1);
  const targets = targetsOf(files, settings);
  const folders = author.Task("folders", "file-management");
  const make = "import os, sys\n[os.makedirs(name, exist_ok=True) for name in sys.argv[sys.argv.index('--') + 1:]]";
  folders.addCommand(author.Command("exec", {
    exe: "{blender}",
    args: ["--background", "--factory-startup", "--python-expr", make, "--", ...new Set(targets.map((target) => path.dirname(target)))],
  }));
  job.addTask(folders);
  for (let start = 0; start < files.length; start += size) {
    const chunk = files.slice(start, start + size);
    const name = chunk.length === 1 ? path.basename(chunk[0]) : `${path.basename(chunk[0])} and ${chunk.length - 1} more`;
    const task = author.Task(name, "blender");
    task.addDependency(folders);
    chunk.forEach((file, index) => addCommands(task, file, targets[start + index], settings));
    job.addTask(task);
  }
}

function listFiles(text) {
  return text.split(/[;\r\n]+/).map((name) => name.trim()).filter((name) => name.length);
}

// Where each file's levels go; files that would meet there keep their ending as a part of the name.
function targetsOf(files, settings) {
  const place = (file, stem) => {
    const ending = settings.ending || file.slice(file.lastIndexOf("."));
    return path.join(settings.output_dir, path.dirname(below(file, settings.input_dir)), stem + ending);
  };
  const stemOf = (file) => path.basename(file).replace(/\.[^.]*$/, "");
  const first = files.map((file) => place(file, stemOf(file)));
  const times = {};
  first.forEach((target) => { times[target.toLowerCase()] = (times[target.toLowerCase()] || 0) + 1; });
  return files.map((file, i) => times[first[i].toLowerCase()] > 1 ? place(file, path.basename(file)) : first[i]);
}

function below(file, folder) {
  const root = (folder || "").replace(/[\\/]+$/, "");
  if (root && (file.startsWith(root + "/") || file.startsWith(root + "\\"))) return file.slice(root.length + 1);
  return path.basename(file);
}

function addCommands(task, file, target, settings) {
  const words = settings.levels.split(/\s+/).filter((word) => word.length);
  task.addCommand(author.Command("exec", {
    exe: "{blender}",
    args: ["--command", "eso_lod", "lod", file, target, "--profile", settings.profile || "plain", ...words],
  }));
}
