% Read a session that rigidimeter exported, and its estimates. MATLAB, or Octave 7 and later.
%
%   rigidimeter export SESSION --to mat --out session.mat
%   rigidimeter estimate SESSION --json estimates.json
%   [session, epochs] = read_session('session.mat', 'estimates.json')
%
% session.torque, .motion and .control hold one column of numbers for each signal, at its own rate;
% epochs holds one row for each epoch. Units stand in every name; NaN is "not estimated".
function [session, epochs] = read_session(mat_file, json_file)
  session = load(mat_file);
  document = jsondecode(fileread(json_file));
  assert(strncmp(document.schema, 'rigidimeter.estimates/', 22), 'not a file of estimates')
  rows = document.epochs;
  if ~iscell(rows), rows = num2cell(rows); end
  names = {'source', 'epoch', 'condition', 'outcome', 'inertia_kg_m2', 'damping_nm_s_rad', ...
           'stiffness_nm_rad', 'stiffness_nm_rad_low', 'stiffness_nm_rad_high'};
  for k = 1:numel(rows)
    for n = names
      value = rows{k}.(n{1});
      if isempty(value) && ~ischar(value), value = NaN; end
      epochs(k).(n{1}) = value;
    end
  end
end
