// SPDX-License-Identifier: MIT
#include "host-tools/compbox/commands.h"

#include "host-tools/compbox/live/commands.h"

namespace compbox {

void add_computing_commands(cli::command &app) {
    app.require_subcommand();
    add_init(app);
    add_fit(app);
    add_report(app);
    add_etve(app);
    add_plan(app);
    add_assemble(app);
    add_identify(app);
    add_squareness(app);
    add_volumetric(app);
    add_select_inputs(app);
    add_train(app);
    add_prior(app);
    add_sensors(app);
    add_build(app);
    add_pack(app);
    add_check(app);
    add_eval(app);
    add_export(app);
    add_join(app);
}

void add_commands(cli::command &app) {
    add_computing_commands(app);
    add_simulate(app);
    add_signing(app);
    live::add_commission(app);
    live::add_plc(app);
    live::add_measured(app);
    live::add_watch(app);
    live::add_fleet(app);
    app.set_help_all_flag("--help-all", "Help of every command");
}

}  // namespace compbox
