// covol in ImageJ and Fiji: computes the surface through marks on the open stack; results are a mask, outlines on all slices and a table.
//
// Put this file into the folder plugins: it is then Plugins > Covol. Marks are the ROIs of the ROI Manager, or the selection if it is
// empty: points (multi-point tool) are on the border; outlines (polygon, freehand, ellipse, rectangle) are the border on their slices.
// Needs the program covol (docs/install.md) and Linux. A script passes its settings as lines; then no dialog is shown, and an error
// message or "" is returned:
//     said = runMacro("Covol_.ijm", "program=/usr/bin/covol\nvoxel size=2vx\noptions=--model paper\nreport=/tmp/cell.html");

function settingOf(lines, name, missing) {
    for (i = 0; i < lines.length; i++)
        if (startsWith(lines[i], name + "=")) return substring(lines[i], lengthOf(name) + 1);
    return missing;
}

// Returns 1 for a selection that is an area (types 0 to 4 and 9), otherwise 0: for points (10), and for lines (5 to 8), whose corners
// are used as marks like points.
function isArea(type) {
    if (type <= 4 || type == 9) return 1;
    return 0;
}

// Saves those ROIs of the ROI Manager that are areas (areas = 1), or those that are not (areas = 0); returns their number.
function saveManaged(areas, path) {
    chosen = newArray(0);
    for (i = 0; i < roiManager("count"); i++) {
        roiManager("select", i);
        if (isArea(selectionType()) == areas) chosen = Array.concat(chosen, i);
    }
    if (chosen.length > 0) {
        roiManager("select", chosen);
        roiManager("save selected", path);
    }
    roiManager("deselect");
    return chosen.length;
}

// Runs a command and returns its output. A shell reads the arguments from a file, one per line, so that it does not interpret them.
function runProgram(words, path) {
    text = "";
    for (i = 0; i < words.length; i++) text = text + words[i] + "\n";
    File.saveString(text, path);
    return exec("sh", "-c", "while IFS= read -r word; do set -- \"$@\" \"$word\"; done <\"$0\"; unset LD_LIBRARY_PATH; exec \"$@\" 2>&1", path);
}

// Deletes the temporary folder of a run, which contains only files.
function deleteFolder(folder) {
    left = getFileList(folder);
    for (i = 0; i < left.length; i++) ok = File.delete(folder + "/" + left[i]);
    ok = File.delete(folder);
}

scripted = lengthOf(getArgument()) > 0;
wrong = "";
if (nImages == 0) {
    wrong = "covol: open a stack first";
    if (scripted) return wrong;
    exit(wrong);
}
stack = getImageID();
title = getTitle();
getDimensions(width, height, channels, slices, frames);
if (slices < 2 && frames > 1) wrong = "covol: expected a stack of slices, got time points; see Image > Hyperstacks > Re-order Hyperstack";
managed = 0;
if (isOpen("ROI Manager")) managed = roiManager("count");
if (managed == 0 && selectionType() < 0) wrong = "covol: set marks on the border first: points, or outlines in the ROI Manager";
if (wrong != "") {
    if (scripted) return wrong;
    exit(wrong);
}
Stack.getPosition(channel, slice, frame);

lines = split(getArgument(), "\n");
program = settingOf(lines, "program", call("ij.Prefs.get", "covol.program", "covol"));
voxelSize = settingOf(lines, "voxel size", "");
options = settingOf(lines, "options", "");
report = settingOf(lines, "report", "");
if (!scripted) {
    Dialog.create("covol");
    Dialog.addFile("Program", program);
    Dialog.addString("Voxel size", voxelSize, 12);
    Dialog.addString("Further options", options, 30);
    Dialog.addCheckbox("Page of the result in the browser", false);
    Dialog.addMessage("Voxel size: in the image's unit, or 2vx for voxels; empty: automatic.");
    Dialog.show();
    program = Dialog.getString();
    voxelSize = Dialog.getString();
    options = Dialog.getString();
    if (Dialog.getCheckbox()) report = getDirectory("temp") + "covol_report.html";
    call("ij.Prefs.set", "covol.program", program);
}

// A folder with a unique name.
folder = getDirectory("temp") + "covol-" + d2s(getTime(), 0) + "-" + floor(1e6 * random());
File.makeDirectory(folder);
words = newArray(program, "segment", folder + "/stack.tif");
if (managed > 0) {
    if (saveManaged(0, folder + "/points.zip") > 0) words = Array.concat(words, newArray("--points", folder + "/points.zip"));
    if (saveManaged(1, folder + "/outlines.zip") > 0) words = Array.concat(words, newArray("--contours", folder + "/outlines.zip"));
} else {
    saveAs("Selection", folder + "/marks.roi");
    kind = "--points";
    if (isArea(selectionType()) == 1) kind = "--contours";
    words = Array.concat(words, newArray(kind, folder + "/marks.roi"));
}
if (channels > 1) words = Array.concat(words, newArray("--points-channels", "" + channels, "--channel", "" + (channel - 1)));
if (frames > 1) words = Array.concat(words, newArray("--frame", "" + (frame - 1)));
if (voxelSize != "") words = Array.concat(words, newArray("--voxel-size=" + voxelSize));
if (options != "") {
    more = split(options, " ");
    words = Array.concat(words, more);
}
if (report != "") words = Array.concat(words, newArray("--report", report));
words = Array.concat(words, newArray("-o", folder + "/surface.vdb", "--mask", folder + "/mask.tif", "--table", folder + "/table.csv"));

// Saves a copy of the displayed stack without its selection. The stack itself keeps its name and its marks.
showStatus("covol: saving the stack");
wasBatch = is("Batch Mode");
if (!wasBatch) setBatchMode(true);
selectImage(stack);
Roi.remove;
run("Duplicate...", "title=covol-copy duplicate");
saveAs("Tiff", folder + "/stack.tif");
close();
selectImage(stack);
if (File.exists(folder + "/marks.roi")) open(folder + "/marks.roi");

showStatus("covol: finding the surface");
said = runProgram(words, folder + "/words.txt");
if (!File.exists(folder + "/mask.tif")) {
    at = indexOf(said, "covol: error: ");
    if (at >= 0) said = substring(said, at + 14);
    deleteFolder(folder);
    if (!wasBatch) setBatchMode("exit and display");
    if (scripted) return "covol: " + said;
    exit("covol: " + said);
}

// Adds an outline to the overlay on every slice that contains the structure.
open(folder + "/mask.tif");
rename("Mask of " + title);
mask = getImageID();
selectImage(stack);
Overlay.remove;
for (z = 1; z <= slices; z++) {
    selectImage(mask);
    if (slices > 1) setSlice(z);
    getStatistics(area, mean, min, max);
    if (max == 0) continue;
    setThreshold(1, 255);
    run("Create Selection");
    selectImage(stack);
    run("Restore Selection");
    Overlay.addSelection("yellow", 1);
    if (channels > 1 || frames > 1) Overlay.setPosition(0, z, 0);
    else Overlay.setPosition(z);
}
selectImage(mask);
Roi.remove;
resetThreshold;
setMinAndMax(0, 1);
selectImage(stack);
Roi.remove;
if (File.exists(folder + "/marks.roi")) open(folder + "/marks.roi");
Overlay.show;
Stack.setPosition(channel, slice, frame);
if (!wasBatch) {
    setBatchMode("exit and display");
    selectImage(stack);
}

Table.open(folder + "/table.csv");
Table.rename("table.csv", "covol: " + title);
warnings = split(said, "\n");
for (i = 0; i < warnings.length; i++)
    if (startsWith(warnings[i], "covol: warning: ")) print(warnings[i]);
deleteFolder(folder);
if (report != "" && !scripted) run("URL...", "url=file://" + report);
showStatus("covol: done");
return "";
