"""The paper's open-loop replay of a recorded drop (Neisi 2020, section 3).

Each row of the flowchart (Fig. 4) is a function:

=============================================  ======================================================
row of the flowchart                           function
=============================================  ======================================================
measured displacements and speed               `rotordrop.evidence.evidence.read_evidence`
air gap from the settled tail                  `rotordrop.evidence.air_gap.identify_air_gap`
speed and aerodynamic torque, eq. (13)         `rotordrop.evidence.speed.identify_speed`
initial conditions, modal expansion, eq. (16)  `rotordrop.replay.start.expand_initial_state`
initial conditions, as used                    `rotordrop.evidence.initial_state.fit_initial_state`
first contacts, single mass, eq. (17)          `rotordrop.evidence.first_contact.identify_first_contacts`
support properties by least squares            `rotordrop.replay.supports.fit_supports`
friction coefficient                           `rotordrop.replay.friction.sweep_friction`
simulation of the dropdown                     `rotordrop.replay.open_loop.whole_drop`
simulated and measured orbit compared          `rotordrop.replay.agreement.compare_orbits`
bearing force and stress                       `rotordrop.replay.result.replay_bearings`
=============================================  ======================================================

The paper has no intervals; they come from `rotordrop.replay.open_loop.draw_drops`.
"""
