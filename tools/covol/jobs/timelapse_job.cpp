#include "jobs/timelapse_job.h"

#include <algorithm>
#include <filesystem>

#include "cli/options/option_names.h"
#include "covol/error.h"
#include "jobs/name_tag.h"
#include "jobs/structures_job.h"
#include "jobs/usd_scene.h"

namespace covol::tool {
namespace {

/// One image of the series.
struct Frame {
    std::string path;
    ReadImageOptions options;
    int number = 0;
};

std::vector<Frame> frames_of(const SegmentJob& job) {
    std::vector<Frame> frames;
    if (job.images.size() > 1) {
        if (job.frames.given && !job.frames.is_one())
            throw UsageError("--frame: expected one number with several images, which are the frames");
        ReadImageOptions options = job.image.options;
        if (job.frames.given) options.frame = job.frames.first;
        for (const std::string& path : job.images) frames.push_back({path, options, int(frames.size())});
        return frames;
    }
    const int count = read_image_info(job.images.front(), job.image.options).frames;
    const int first = job.frames.all ? 0 : job.frames.first, last = job.frames.all ? count - 1 : job.frames.last;
    if (last >= count)
        throw Error(Errc::InvalidOptions, "--frame: expected frames 0 to " + std::to_string(count - 1) + " of " +
                                              job.images.front() + ", got " + std::to_string(last));
    for (int n = first; n <= last; ++n) {
        frames.push_back({job.images.front(), job.image.options, n});
        frames.back().options.frame = n;
    }
    return frames;
}

/// Processes the frames of the series one after the other.
class FrameRunner {
public:
    FrameRunner(const SegmentJob& job, Session& session)
        : job_(job), session_(session), structures_(structures_of(job)), rows_({}) {}

    void run() {
        if (!job_.painted.paths.empty() || !job_.guess.paths.empty())
            throw UsageError("--painted, --guess: expected one image, got a time-lapse");
        if (names_structures(job_))
            throw UsageError(
                "--structure-column, structure sets of DICOM: expected one image, got a time-lapse, whose marks have a "
                "file for each structure");
        frames_ = frames_of(job_);
        check();
        add_starts(job_, structures_, session_.run());
        for (const Frame& frame : frames_) {
            session_.run().check();
            go(frame);
        }
        session_.report()["frames"] = reports_;
        Table table(columns());
        session_.outputs().add(job_.table_path, [text = table.add_rows(rows_).text(), &run = session_.run()](
                                                    const std::string& path) { write_text(path, text, run); });
        write_scene(scene_, job_, session_);
        if (failed_ == int(frames_.size()))
            throw Error(first_error_, "no frame could be segmented; the first: " + first_message_);
        if (failed_ > 0) {
            session_.warn(std::to_string(failed_) + " of " + std::to_string(frames_.size()) + " frames failed");
            session_.set_exit_code(exit_code_of(first_error_));
        }
    }

private:
    [[nodiscard]] std::vector<std::string> columns() const {
        std::vector<std::string> names = result_columns(unit_);
        names.insert(names.begin(), "frame");
        names.emplace_back("status");
        return names;
    }

    [[nodiscard]] NameTag tag(const Frame& frame) const {
        const int digits = std::max(3, int(std::to_string(frames_.back().number).size()));
        return {"_t" + padded(frame.number, digits), frame.number};
    }

    [[nodiscard]] NameTag tag_in_series(const Frame& frame) const {
        NameTag own = tag(frame);
        for (const Frame& other : frames_) own.series.push_back(tag(other));
        return own;
    }

    void check() {
        std::vector<std::string> read;
        for (const Frame& frame : frames_) {
            read.push_back(frame.path);
            for (const Marks& marks : structures_)
                for (const auto* paths : {&marks.files.points, &marks.files.contours})
                    for (const std::string& path : *paths) read.push_back(with_frame(path, frame.number));
        }
        session_.outputs().protect(read);
        for (const Frame& frame : frames_) check_outputs(job_, structures_, tag(frame), session_.outputs());
        session_.outputs().check("--table", job_.table_path, OutputKind::Table);
        check_scene(job_, session_.outputs());
        job_.check_options();
    }

    /// The structures with the files of marks of this frame. A name with {frame} stands for one file for each frame;
    /// other files are used for the first frame only.
    [[nodiscard]] std::vector<Marks> marks_at(const Frame& frame) const {
        std::vector<Marks> structures = structures_;
        for (Marks& marks : structures) {
            marks.files.points = paths_at(frame, marks.files.points);
            marks.files.contours = paths_at(frame, marks.files.contours);
        }
        return structures;
    }

    [[nodiscard]] std::vector<std::string> paths_at(const Frame& frame,
                                                    const std::vector<std::string>& patterns) const {
        std::vector<std::string> paths;
        for (const std::string& path : patterns) {
            if (!has_frame_pattern(path)) {
                if (!lapse_.started()) paths.push_back(path);
                continue;
            }
            const std::string own = with_frame(path, frame.number);
            // Marks are optional once there is a surface to start from.
            if (!lapse_.started() || std::filesystem::exists(own)) paths.push_back(own);
        }
        return paths;
    }

    void go(const Frame& frame) {
        const std::string who = "frame " + std::to_string(frame.number);
        const Stopwatch watch;
        Json report{{"frame", frame.number}, {"image", frame.path}};
        try {
            const auto output = std::make_shared<StructuresOutput>(segment_frame(frame, who));
            queue_outputs(job_, output, tag_in_series(frame), session_, [&](const std::string& path, auto write) {
                if (session_.outputs().write(path, write)) session_.note("wrote " + path);
            });
            add_to_scene(scene_, job_, *output, tag(frame));
            report["status"] = "ok";
            report.update(to_json(*output));
            if (!job_.table_path.empty())
                for (const StructureOutput& s : output->structures) {
                    add_result(rows_.row() << frame.number, s.name.empty() ? s.grid : s.name, s.label, s.result,
                               s.intensity, session_.run());
                    rows_ << "ok";
                }
        } catch (const Error& error) {
            if (error.code() == Errc::Cancelled) throw;
            fail(who, error);
            const std::string status = "failed: " + with_flags(error.what());
            report["status"] = status;
            rows_.row() << frame.number;
            for (std::size_t n = 0; n < result_columns({}).size(); ++n) rows_ << "";
            rows_ << status;
        }
        report["wall_seconds"] = watch.seconds();
        reports_.push_back(report);
    }

    StructuresOutput segment_frame(const Frame& frame, const std::string& who) {
        session_.note(who + ": " + frame.path);
        const Image image = job_.read(frame.path, frame.options, session_);
        RunContext run = session_.run();
        run.log = [this, who](LogLevel level, const std::string& line) {
            level == LogLevel::Warning ? session_.warn(who + ": " + line) : session_.note(who + ": " + line);
        };
        std::vector<Marks> marks = marks_at(frame);
        const StructuresOptions options = read_structures(job_, marks, image, session_, run);
        StructuresOutput output =
            finish(job_, lapse_.segment(image, std::move(marks), options, run), image, session_, run);
        SegmentJob::report_chunks(image, session_);
        unit_ = image.geometry().unit;
        output.frame = frame.options.frame;
        return output;
    }

    void fail(const std::string& who, const Error& error) {
        if (failed_++ == 0) {
            first_error_ = error.code();
            first_message_ = error.what();
        }
        session_.warn(who + " failed: " + error.what());
    }

    const SegmentJob& job_;
    Session& session_;
    std::vector<Marks> structures_;
    std::vector<Frame> frames_;
    TimeLapse lapse_;
    Json reports_ = Json::array();
    UsdScene scene_;
    Table rows_;
    std::string unit_;  ///< unit of length of the frames
    int failed_ = 0;
    Errc first_error_ = Errc::InvalidInput;
    std::string first_message_;
};

}  // namespace

bool is_timelapse(const SegmentJob& job) { return job.images.size() > 1 || (job.frames.given && !job.frames.is_one()); }

void run_timelapse(const SegmentJob& job, Session& session) { FrameRunner(job, session).run(); }

}  // namespace covol::tool
