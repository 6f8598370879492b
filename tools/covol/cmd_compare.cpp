#include <iomanip>

#include "commands.h"
#include "covol/compare.h"
#include "report.h"

namespace covol::tool {
namespace {

struct CompareJob {
    std::string a, b;
    int label = 0, label_b = -1;

    void run(Session& session) const {
        const Stopwatch reading;
        const Solid first = read_solid(a, label);
        const Solid second = read_solid(b, label_b >= 0 ? label_b : label);
        session.add_seconds("read", reading.seconds());
        const Stopwatch watch;
        const CompareReport r = compare(first, second, session.run());
        session.add_seconds("compare", watch.seconds());
        session.report()["compare"] = to_json(r);
        std::ostringstream text;
        text << std::setprecision(6) << "Dice " << r.dice << ", Jaccard " << r.jaccard << ", volumes " << r.volume_a
             << " and " << r.volume_b << "\ndistance between the surfaces: mean " << r.mean_distance << ", 95 % "
             << r.hausdorff95 << ", max " << r.hausdorff;
        session.say(text.str());
    }
};

}  // namespace

void add_compare(Session& session) {
    const auto job = std::make_shared<CompareJob>();
    CLI::App* command = session.add_command("compare", "Overlap and distances of two solids: masks, meshes, .vdb, in any mix",
                                            [job, &session] { job->run(session); });
    command->add_option("a", job->a, "label image, mesh or .vdb")->required()->type_name("A");
    command->add_option("b", job->b, "label image, mesh or .vdb")->required()->type_name("B");
    command->add_option("--label", job->label, "label of the masks, 0: any")->capture_default_str();
    command->add_option("--label-b", job->label_b, "label of B, where it differs");
}

}  // namespace covol::tool
