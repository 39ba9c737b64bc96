% Print J, B and K of each epoch and how far the joint moved, and write a recording of our own.
addpath(fileparts(mfilename('fullpath')))
[session, epochs] = read_session('session.mat', 'estimates.json');
for k = 1:numel(epochs)
  e = epochs(k);
  fprintf('epoch %s: J %.4g kg m^2, B %.4g N m s/rad, K %.4g (%.4g to %.4g) N m/rad\n', e.epoch, ...
          e.inertia_kg_m2, e.damping_nm_s_rad, e.stiffness_nm_rad, ...
          e.stiffness_nm_rad_low, e.stiffness_nm_rad_high);
end
fprintf('angle: SD %.2f deg\n', std(session.motion.angle_rad) * 180 / pi);

% The other way: a recording of ours for `rigidimeter estimate mine.mat`.
time_s = (0:9999)' / 1000;
angle_rad = 0.05 * sin(2*pi*0.7*time_s) + 0.03 * sin(2*pi*2.3*time_s) + 0.01 * sin(2*pi*6.1*time_s);
velocity = gradient(angle_rad, 0.001);
torque_nm = 0.005 * gradient(velocity, 0.001) + 0.14 * velocity + 1.8 * angle_rad;
torque_nm = torque_nm + 0.01 * randn(size(torque_nm));  % in place of a sensor
save('-v7', 'mine.mat', 'time_s', 'torque_nm', 'angle_rad')
